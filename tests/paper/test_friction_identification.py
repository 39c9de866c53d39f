"""Friction near standstill, found as a client by a slow motion there and back; and what the lead makes of it."""

import asyncio
from dataclasses import replace as changed
from functools import cache

import numpy as np
import pytest
from msgspec.structs import replace

from tvist_controller.sources.calibrations import FRICTION, friction_law
from tvist_controller.sources.calibrations import load as calibration
from tvist_controller.sources.own_plants import OwnPlant
from tvist_lab.identification.friction import fit_friction, friction, identify_friction, unknown_friction
from tvist_lab.identification.ring_downs import IdentificationError
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.study.arms import ARMS
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import some
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.work import Job, measure
from tvist_plant.description import load
from tvist_shaping.errors import EstimatorError

ROBOT = load("ur5e")
STRIBECK = next(arm for arm in ARMS if arm.name == "stribeck")
MIDDLE = np.array([0.0, -1.5, 1.2, -1.5, -1.5, 0.0])


@cache
def found(arm=STRIBECK):
    async def run():
        plant = OwnPlant("test", "", lambda description, carried: arm.make(description, carried, 1))
        setup = changed(free_setup(calibration="none", truth=False), plant=plant)
        async with robot_in_process(setup) as robot, robot.control("test") as control:
            await control.set_shaper("none")
            began = (await robot.state()).tick
            places = [np.zeros(6), MIDDLE]  # the first one is in the floor
            parameters = await identify_friction(robot, control, ROBOT, places)
            return parameters, 0.002 * ((await robot.state()).tick - began)

    return asyncio.run(run())


def with_friction(parameters):
    known = calibration("ur5e_modal")
    return replace(known, modal=replace(known.modal, parameters=(*known.modal.parameters, *parameters)))


def test_breakaway_torque_and_width_of_each_joint_are_found():
    parameters, seconds = found()
    assert seconds < 20.0
    true = {"breakaway": 1.5, "stribeck_speed": 0.05, "friction_width": 0.03}
    inside = []
    for one in parameters:
        value = true.get(one.quantity)
        if one.quantity == "coulomb_friction":
            value = ROBOT.drives.coulomb_friction[one.joints[0]]
        if value is not None:
            assert one.status == "identified"
            assert one.value == pytest.approx(value, rel=0.15)
            inside.append(one.interval[0] <= value <= one.interval[1])
    assert np.mean(inside) > 0.8


@pytest.mark.parametrize("breakaway", [1.0, 1.3])
def test_intervals_of_friction_contain_the_truth_at_their_confidence(breakaway, measured):
    speed, unknown = np.concatenate([np.linspace(0.005, 0.3, 70)] * 2), unknown_friction(ROBOT)[1]
    true, inside = np.array([6.0, breakaway, 0.05, 0.03, 3.0]), []
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(len(speed))
        for k in range(1, len(noise)):
            noise[k] = 0.6 * noise[k - 1] + 0.8 * noise[k]
        torque = friction(np.log(true), speed) + 0.05 * (1.0 + 5.0 * speed) * noise
        low, high = np.array([one.interval for one in fit_friction(unknown, speed, torque)]).T
        inside.append((low - 1e-9 <= true) & (true <= high + 1e-9))
    covered = np.mean(np.array(inside)[:, [0, 1, 3, 4] if breakaway == 1.0 else slice(None)], axis=0)
    measured(f"coverage with breakaway {breakaway:g}", str(covered.round(2)))
    # At a breakaway of 1, the edge of what is possible, some decline is found that fits the noise.
    assert covered.mean() > 0.84
    assert covered.min() > 0.75


def test_identified_friction_is_compensated_with_every_shaper(measured):
    """Held-out moves: seed 77 has tuned nothing."""
    known = {"without": calibration("ur5e_modal"), "with": with_friction(found()[0])}
    less = {}
    for name, one in known.items():
        methods = some(["none", "auto", "elastic"], ROBOT, one)
        for number, move in enumerate(draw_moves(ROBOT, 4, 77, (0.0, 5.0)).moves):
            for row in measure(Job(Case(ROBOT, move, seed=number, arms=(STRIBECK,)), methods)):
                if row["reduction_percent"] is not None:
                    less.setdefault((name, row["shaper"]), []).append(row["reduction_percent"])
    median = {key: np.median(values) for key, values in less.items()}
    for shaper in ("elastic", "auto"):
        measured(shaper, f"{median['without', shaper]:.1f} -> {median['with', shaper]:.1f} %")
    assert median["without", "elastic"] < 85.0
    assert median["with", "elastic"] > 95.0
    assert median["with", "auto"] > 94.0 > median["without", "auto"]


async def test_friction_without_free_path_is_not_measured():
    async with robot_in_process(free_setup()) as robot, robot.control("test") as control:
        with pytest.raises(IdentificationError, match="no path of"):
            await identify_friction(robot, control, ROBOT, [np.zeros(6)])


def test_friction_of_some_joints_or_beyond_the_torque_is_refused():
    parameters = found()[0]
    assert friction_law(calibration("ur5e_modal").modal.parameters, ROBOT) is None
    assert friction_law(parameters, ROBOT).shape == (len(FRICTION), 6)
    with pytest.raises(EstimatorError, match="said once for each"):
        friction_law(parameters[:-1], ROBOT)
    large = [replace(one, value=100.0) if one.quantity == "coulomb_friction" else one for one in parameters]
    with pytest.raises(EstimatorError, match=r"coulomb_friction of joint 0 is .* at most the 150 N m"):
        friction_law(large, ROBOT)
