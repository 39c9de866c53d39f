"""What the reference is before shaping, at the tick of the target: on UR's interfaces this is the target."""

import numpy as np
import pytest
from tests.controller.robots import Q1, Q3, H, Robot
from tests.controller.spaces import BENT, pose_of, tool_pose

from tvist_controller.line.differentiator import central_differences
from tvist_protocol import commands as c
from tvist_protocol.motions import MoveL, SpeedJ
from tvist_protocol.simulation import SimulationReset

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


@pytest.mark.parametrize("motion", ["joints", "stream"])
def test_it_is_the_target_of_the_same_motion_without_a_shaper(motion):
    shaped, plain = (moved(motion, name, rest=200).states for name in ("zv", "none"))
    for one, other in zip(shaped[: len(plain)], plain, strict=False):
        assert unshaped(one) == [getattr(other, f"target_{name}") for name in FIELDS]


@pytest.mark.parametrize("motion", MOTIONS)
def test_where_nothing_is_shaped_it_is_null(motion):
    for state in moved(motion, "none").states:
        assert state.unshaped_q is state.unshaped_qd is state.unshaped_qdd is None


@pytest.mark.parametrize("motion", MOTIONS)
def test_it_is_exactly_at_rest_as_soon_as_the_reference_is_and_null_soon_after_the_shaped_one_is(motion):
    robot = moved(motion, "zv")
    reference = robot.column("reference_q")
    last = int(np.flatnonzero(np.any(np.diff(reference, axis=0), axis=1))[-1]) + 1
    for state in robot.states[last + 2 :]:
        assert unshaped(state) == [reference[-1].tolist(), [0.0] * 6, [0.0] * 6]
    assert robot.states[last + 10].unshaped_q is not None
    assert all(state.unshaped_q is None for state in robot.states[-40:])


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


def test_a_guided_motion_that_bypasses_the_shaper_has_no_other_target():
    robot = Robot(q=tuple(BENT), shaper="zv")
    for _ in range(100):
        assert robot.send(SpeedJ, qd=(0.2,) * 6, acceleration=1.0).__class__.__name__ in {"Accepted", "Done"}
        assert robot.tick().unshaped_q is None


def test_a_reset_starts_anew():
    robot = Robot(shaper="zv")
    joints(robot)
    robot.tick(300)
    assert robot.states[-1].unshaped_q is not None
    robot.send(SimulationReset, q=tuple(Q3))
    assert robot.controller.latest.unshaped_q is None
    for _ in range(5):
        assert robot.tick().unshaped_q is None
        assert robot.states[-1].target_qd == [0.0] * 6


def test_another_shaper_in_motion_changes_nothing_of_it():
    robots = [Robot(shaper="zv") for _ in range(2)]
    for number, robot in enumerate(robots):
        joints(robot)
        robot.tick(200)
        if number:
            robot.send(c.SetShaper, name="ei")
        robot.tick(600)
    for one, other in zip(*(robot.states for robot in robots), strict=True):
        assert unshaped(one) == unshaped(other)
