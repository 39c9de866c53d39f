"""A robot that nobody knows is identified, as a client."""

from dataclasses import replace as changed

import numpy as np
import pytest
from msgspec.structs import replace

from tvist_client import make_payload
from tvist_controller.setup import paper_payload
from tvist_controller.sources.calibrations import load as calibration
from tvist_controller.sources.own_plants import OwnPlant
from tvist_lab.identification.calibrate import calibrate
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.identification.payload import identify_payload
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import some
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.work import Job, measure
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.variants import Variant
from tvist_plant.variants import hidden as drawn

ROBOT = load("ur5e")
SEED = 101  # seeds below have been looked at while the identification was made
MASSES = 0.03


def hidden(seed):
    """Draw springs, drives, masses of the links, and the carried mass."""
    random, arm = np.random.default_rng([seed, 61]), drawn(ROBOT, seed)
    factor = random.uniform(1.0 - MASSES, 1.0 + MASSES, ROBOT.joints)
    links = replace(
        ROBOT.links,
        mass=tuple((factor * ROBOT.links.mass).tolist()),
        inertia=tuple(map(tuple, (factor[:, None] * ROBOT.links.inertia).tolist())),
    )
    return replace(arm, links=links), float(random.uniform(0.5, 5.0))


async def identified(arm, mass):
    """Weigh the payload, declare it, and identify springs and friction; with the robot time that it takes [s]."""
    plant = OwnPlant("test", "", lambda _, carried: FlexibleArm(arm, carried))
    setup = changed(free_setup(calibration="none", truth=False), plant=plant)
    async with robot_in_process(setup) as robot, robot.control("test") as control:
        disc = paper_payload(ROBOT, mass)
        await control.reset(payload=make_payload(mass, disc.com, disc.inertia))
        began = (await robot.state()).tick
        payload = await identify_payload(robot, control, ROBOT, progress=lambda _: None)
        told = payload.payload
        await control.set_payload(told.mass, told.com, told.inertia)
        jogs = await make_jogs(robot, control, await plan_jogs(robot, ROBOT), lambda _: None)
        done = calibrate(ROBOT, jogs, name="hidden", command="a test", progress=lambda _: None)
        return payload, done.calibration, 0.002 * ((await robot.state()).tick - began)


def true_values(arm):
    """What each quantity is, of the first joint or link that a parameter names."""
    drives, flexible = arm.drives, arm.link_flexibility
    slope = np.array(drives.coulomb_friction) / drives.friction_width
    damped = np.array(drives.velocity_gain) + slope
    position = np.array(drives.velocity_gain) * np.add(drives.position_gain, drives.integral_gain) / damped
    return {
        "gear_stiffness": drives.gear_stiffness,
        "velocity_gain": damped,
        "position_gain": [position[:3].mean()] * 6,
        "rotor_inertia": drives.rotor_inertia,
        "damping_time": [flexible.damping_time] * 6,
        "bending_stiffness": dict(zip(flexible.links, flexible.stiffness, strict=True)),
        "coulomb_friction": drives.coulomb_friction,
        "breakaway": [1.0] * 6,
        "friction_width": [drives.friction_width] * 6,
    }


def left_out(arm, mass, declared, known):
    """Median reduction of `elastic` over moves that nothing was tuned on [%]."""
    variant = Variant("hidden", "hidden", truly=lambda *_: arm)
    methods, found = some(["none", "elastic"], ROBOT, known), []
    for number, move in enumerate(draw_moves(ROBOT, 6, 7000 + SEED, (mass, mass)).moves):
        case = Case(ROBOT, move, seed=number, arms=(variant,), payload_error=declared / mass - 1.0)
        rows = [row for row in measure(Job(case, methods)) if row["shaper"] == "elastic"]
        found += [row["reduction_percent"] for row in rows]
    return float(np.median([one for one in found if one is not None]))


@pytest.mark.nightly
async def test_hidden_robot_is_identified_within_its_intervals(measured):
    arm, mass = hidden(SEED)
    payload, known, seconds = await identified(arm, mass)
    found, true, inside = payload.payload.mass, true_values(arm), []
    assert seconds < 100.0
    assert abs(found - mass) < min(0.3, 3.0 * payload.mass_deviation)
    for one in known.modal.parameters:
        if one.status == "identified" and one.quantity in true:
            value = true[one.quantity][one.joints[0]]
            inside.append(one.interval[0] * 0.9999 <= value <= one.interval[1] * 1.0001)
    own, usual = (left_out(arm, mass, *one) for one in ((found, known), (mass, calibration("ur5e_modal"))))
    measured("elastic", f"{own:.1f} %, with the calibration of the package {usual:.1f} %")
    measured("inside the intervals", f"{np.mean(inside):.3f} of {len(inside)}")
    assert np.mean(inside) > 0.88
    assert own > max(usual, 90.0)
