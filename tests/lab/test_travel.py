"""Motions of an identification keep the torque limits of every arm, also with softer or stiffer springs."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import AsyncMock

import numpy as np
import pytest
from msgspec import structs
from tests.lab.conftest import torques_along

from tvist_controller.api.line import (
    MotionLimits,
    paper_payload,
)
from tvist_lab.collect import collect
from tvist_lab.identification.design import free_configurations
from tvist_lab.identification.jogs import MIN_RING_DOWNS, plan_ways
from tvist_lab.identification.travel import Travel
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load, robots
from tvist_plant.plant import PERIOD
from tvist_plant.variants import stiffer

CANDIDATES = 20
RINGING = 0.4  # time after a motion in which the arm vibrates [s]
VARIED = [
    (name, factor) for name in robots() for factor in (0.5, 1.0, 1.5) if (name, factor) != ("ur10e", 1.0)
]


def stretched_and_upright(arm):
    """Return the first pose, in which the weight of a UR arm takes most torque, and the upright one."""
    upright = np.zeros(arm.joints)
    upright[[joint for joint in (1, 3) if joint < arm.joints]] = -np.pi / 2.0
    return np.array(next(iter(arm.poses.values()))), upright


def assert_torques_kept(arm, payload, start, end, limits):
    """Check weight, friction and twice the motion's torque: an undamped arm swings by as much again."""
    weight, moving = torques_along(arm, payload, start, end, limits)
    needed = np.abs(weight) + 2.0 * np.abs(moving) + np.array(arm.drives.coulomb_friction)
    assert (needed.max(axis=0) <= np.array(arm.limits.torque)).all()


@pytest.mark.parametrize("name", robots())
def test_planned_jogs_and_their_ring_downs_keep_the_torque_limits(name, monkeypatch):
    monkeypatch.setattr("tvist_lab.identification.jogs.MAX_CHOSEN", 0)  # candidates are taken in order
    arm = load(name)
    payloads = tuple(paper_payload(arm, mass) for mass in (0.0, arm.payload.mass))
    candidates = free_configurations(arm, payloads, CANDIDATES, seed=0)
    first, _ = stretched_and_upright(arm)
    jogs = plan_ways(ArmModes(arm, payloads), candidates, first, [MIN_RING_DOWNS] * 2)
    assert len(jogs) == 2 * MIN_RING_DOWNS
    for jog in jogs:
        assert_torques_kept(arm, payloads[jog.payload], jog.way[-1], jog.q, jog.limits)


@pytest.mark.parametrize("name", robots())
async def test_ways_between_stretched_and_upright_arm_keep_the_torque_limits(name):
    arm = load(name)
    payload, (first, upright) = paper_payload(arm), stretched_and_upright(arm)
    for start, end in ((first, upright), (upright, first)):
        robot = SimpleNamespace(state=AsyncMock(return_value=SimpleNamespace(target_q=start)))
        control = SimpleNamespace(move_j=AsyncMock())
        await Travel(robot, control, arm, payload).move(end)
        assert_torques_kept(arm, payload, start, end, MotionLimits(**control.move_j.call_args.kwargs))


@pytest.mark.parametrize(
    ("name", "factor"), [("ur10e", 1.0), *(pytest.param(*one, marks=pytest.mark.nightly) for one in VARIED)]
)
async def test_drives_of_a_flexible_arm_keep_their_torque_limits_on_these_ways(name, factor):
    arm = stiffer(factor, load(name))
    first, upright = stretched_and_upright(arm)
    setup = replace(free_setup(robot=name, calibration="none", shaper="none"), description=arm)
    async with robot_in_process(setup) as robot, robot.control("test") as control:
        travel = Travel(robot, control, arm, setup.payload)
        with collect(robot) as collected:
            for q in (upright, first):
                await travel.move(q)
                await robot.advance(round(RINGING / PERIOD))
    taken = np.abs(collected.recording()["actual_moment"]).max(axis=0)
    assert (taken <= np.array(arm.limits.torque)).all()


async def test_arm_whose_weight_takes_nearly_all_torque_moves_slowly():
    arm = load("ur10e")
    weak = structs.replace(arm, limits=structs.replace(arm.limits, torque=(250.0,) * 6))
    first, upright = stretched_and_upright(arm)
    robot = SimpleNamespace(state=AsyncMock(return_value=SimpleNamespace(target_q=first)))
    control = SimpleNamespace(move_j=AsyncMock())
    await Travel(robot, control, weak, paper_payload(arm)).move(upright)
    assert 0.0 < control.move_j.call_args.kwargs["acceleration"] < 0.1
