"""The control line as a whole: Figure 6."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.search.spaces import BENT, pose_of, tool_pose

from tvist_controller.line.differentiator import STILL, central_differences
from tvist_controller.line.line_mode import LineMode, check_change
from tvist_protocol import commands as c
from tvist_protocol.motions import MoveL
from tvist_shaping.estimators.fixed import Fixed

from .robots import FITTING, PAPER, Q1, Q2, Q3, H, Robot, without_arm


def motion(line, target, limits=PAPER):
    """Shaped reference at every tick of a motion, and for a while after; ticks until it was said to rest."""
    line.begin(line.plan(np.array(target), limits))
    shaped, rested = [], None
    for tick in range(6000):
        line.step()
        shaped.append(line.position)
        if rested is None and line.at_rest:
            rested = tick
        if rested is not None and tick > rested + 600:
            return np.array(shaped), rested
    raise AssertionError("still moving")


@pytest.mark.parametrize("name", FITTING)
@pytest.mark.parametrize("target", [Q2, Q3, Q1 + 0.3, Q1 + 1e-3])
def test_at_rest_is_one_tick_after_the_last_that_moved(name, target):
    """A target is the shaped reference of a tick before, so that tick is two after the last that moved.

    Up to two more where a small last impulse makes steps below 1e-7 rad that come to more than that together.
    """
    shaped, rested = motion(without_arm(name), target)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    last_moved = np.flatnonzero(steps > STILL)[-1] + 1
    assert last_moved + 2 <= rested <= last_moved + (2 if name in {"none", "zv"} else 4)
    assert (shaped[-1] == target).all()


@pytest.mark.parametrize("name", ["zv", "zvd", "ei3"])
def test_a_plateau_between_two_impulses_is_no_rest(name):
    """A jog of 0.1 mrad lasts 32 ms, the shaper 75 ms and more: in between the shaped reference stands still."""
    line = without_arm(name, estimator=Fixed([6.7], [0.1]))
    shaped, rested = motion(line, Q1 + 1e-4)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    assert (steps[: rested - 2] < STILL).sum() > 15
    assert rested * H > line.tvist.delay
    assert np.abs(shaped[rested:] - Q1 - 1e-4).max() <= STILL
    assert (shaped[rested + 20 :] == Q1 + 1e-4).all()


def test_a_stop_is_final_and_what_bypasses_the_filter_is_not_shaped_before_it_rests():
    assert set(LineMode.STOPPING.followed_by) == {"REST", "STOPPING"}
    for mode in LineMode:
        if not mode.shaped:
            assert not any(LineMode[after].shaped for after in mode.followed_by if after != "REST")


def test_every_pair_of_modes_is_judged_by_the_table():
    for before in LineMode:
        for after in LineMode:
            if after.name in before.followed_by:
                check_change(before, after, guarded=True)
            else:
                with pytest.raises(ValueError, match=f"from {before.name} to {after.name}"):
                    check_change(before, after, guarded=True)


FIELDS = ("q", "qd", "qdd")


def unshaped(state):
    """Position, velocity and acceleration before shaping; what is null is that of the target."""
    return [
        own if (own := getattr(state, f"unshaped_{name}")) is not None else getattr(state, f"target_{name}")
        for name in FIELDS
    ]


def column(states, number):
    return np.array([unshaped(state)[number] for state in states])


def line(robot):
    position, turned = tool_pose(robot.controller.setup.q, (0.0,) * 6)
    return robot.send(MoveL, pose=pose_of(position + np.array([0.1, 0.05, -0.1]), turned))


def joints(robot):
    return robot.send(c.MoveJ, q=tuple(Q3))


def stream(robot):
    robot.send(c.ServoStart)
    for number in range(300):
        robot.setpoint(number, Q1 + 0.05 * np.sin(0.02 * number) ** 2)
        robot.tick()
    robot.send(c.ServoStop)


MOTIONS = {"joints": (Q1, joints), "line": (BENT, line), "stream": (Q1, stream)}


def moved(motion, shaper, *, rest=50):
    start, begin = MOTIONS[motion]
    robot = Robot(q=tuple(start), shaper=shaper)
    robot.tick(5)
    begin(robot)
    robot.until_rest()
    robot.tick(rest)
    return robot


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shaper", ["zv", "ei"])
def test_it_is_the_reference_of_a_tick_ago_with_its_central_differences(motion, shaper):
    states = moved(motion, shaper).states
    reference = np.array([state.reference_q for state in states])
    assert np.abs(reference - np.array([state.target_q for state in states])).max() > 1e-3
    for number, expected in enumerate(central_differences(reference, H)):
        # Velocities are differences of neighbours here, which rounds in another way.
        np.testing.assert_allclose(
            column(states, number)[2:], expected, rtol=0.0, atol=(0.0, 1e-12, 0.0)[number]
        )


@pytest.mark.parametrize("motion", ["joints", "line"])
def test_a_stop_takes_it_to_the_shaped_reference_without_a_peak_in_its_derivatives(motion):
    start, begin = MOTIONS[motion]
    robot = Robot(q=tuple(start), shaper="zv")
    begin(robot)
    robot.tick(400)
    assert robot.states[-1].unshaped_q is not None
    before = len(robot.states)
    robot.send(c.Stop)
    robot.until_rest()
    for state in robot.states[before:]:
        assert state.unshaped_q is state.unshaped_qd is None
    velocity, acceleration = (np.abs(column(robot.states, number)).max() for number in (1, 2))
    shaped = robot.column("target_qdd")
    assert velocity < 2.0
    assert acceleration <= max(np.abs(shaped).max(), 2.1)


def test_the_page_on_architecture_draws_the_modes_of_the_line():
    picture = Path(__file__).parents[2] / "docs/images/line-modes.svg"
    drawn = " ".join(re.findall(r'data-ways="([^"]+)"', picture.read_text("utf-8"))).split()
    ways = {f"{mode.name}-{after}" for mode in LineMode for after in mode.followed_by if after != mode.name}
    assert sorted(drawn) == sorted(ways)
