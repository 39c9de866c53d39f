"""Shaped references keep the limits of the arm's joints, velocity, acceleration and torque, with every arm."""

from pathlib import Path

import numpy as np
import pytest
from tests.search.draws import WITHIN, own_limits
from tests.search.subject import Subject, refused, speeds, torques

from tvist_controller.dispatch.planner import Planner
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.setup import paper_payload
from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics
from tvist_protocol.motions import MoveL
from tvist_protocol.replies import Accepted

SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
TORQUE = 1.001
"""Largest ratio of a shaped reference's torque to the limit, for sampling [-]."""
USED = 0.985
"""Smallest share of a limit that a move uses which is slower for it [-]: its torque is taken for proportional to its
acceleration, of which a shaper makes less where its impulses overlap less.
"""


def ratios(robot):
    """Largest velocity, acceleration and torque of the shaped references over the joints' limits [-]."""
    arm, q = robot.description, np.array(robot.references)
    torque = np.abs(torques(arm, robot.payload, q)) / arm.limits.torque
    return np.array([*speeds(arm, q), torque.max()])


def assert_kept(robot, *, torque=True):
    found = ratios(robot)
    assert (found <= [WITHIN, WITHIN, TORQUE if torque else np.inf]).all(), found


def moved(arm, shaper, start, goal, payload, limits):
    """Make a move that is as quick as the arm can, and says what it is slower for; False if it would collide."""
    robot = Subject(arm, np.array(start), payload, shaper=shaper)
    reply = robot.send(c.MoveJ, q=tuple(goal), **limits)
    if refused(reply):
        assert reply.code == "collision", reply
        return False
    assert robot.until_rest()
    assert_kept(robot)
    if reply.limited is not None:
        assert ratios(robot).max() > USED, (reply.limited, ratios(robot))
    return True


@pytest.mark.parametrize(
    ("name", "shaper", "start", "goal"),
    [
        (
            SEVEN,
            "none",
            (1.958304, -1.028545, -1.13757, -1.139029, 1.528591, 1.698451, 0.433821),
            (-2.8215, -1.593834, 2.016334, -1.672621, 1.940885, 0.612649, -1.826071),
        ),
        (
            "ur30",
            "auto-target",
            (1.742287, -0.668323, -0.58706, -0.625696, -1.401523, 1.611268),
            (-3.068842, -2.55983, -0.295144, -0.865182, -0.721249, -0.326427),
        ),
    ],
    ids=["seven", "ur30"],
)
def test_moves_that_are_heavy_for_a_moment_or_hardly_lighter_when_slower_keep_all_limits(
    name, shaper, start, goal
):
    arm = load(name)
    assert moved(arm, shaper, start, goal, paper_payload(arm), own_limits(arm))


def paper_robot(shaper, pose="Q1"):
    arm = load("ur5e")
    q = arm.poses[pose] if isinstance(pose, str) else pose
    return Subject(arm, np.array(q), paper_payload(arm), shaper=shaper)


@pytest.mark.parametrize("shaper", ["zv", "auto", "zvd"])
def test_a_line_of_the_tool_keeps_the_torques_as_well(shaper):
    q = (0.0, -0.55, 1.0, -2.02, -1.57, 0.0)
    robot = paper_robot(shaper, q)
    x, y, z, *turn = robot.send(ForwardKinematics, q=q).pose
    reply = robot.send(MoveL, pose=(x, y, z + 0.25, *turn), velocity=3.0, acceleration=40.0, jerk=4000.0)
    assert isinstance(reply, Accepted), reply
    assert reply.limited.endswith("so that the torque of joint shoulder stays within 150 N m")
    assert robot.until_rest()
    assert_kept(robot)
    assert ratios(robot)[2] > 0.99


def test_a_shaper_that_exceeds_more_slows_down_what_is_under_way():
    robot = paper_robot("zv")
    reply = robot.send(c.MoveJ, q=robot.description.poses["Q3"], **own_limits(robot.description))
    assert isinstance(reply, Accepted)
    robot.tick(100)
    robot.send(c.SetShaper, name="ei3")
    assert robot.until_rest()
    assert_kept(robot, torque=False)


@pytest.mark.parametrize("kind", ["servo_j", "speed_j"])
def test_a_shaper_that_exceeds_more_slows_down_a_guided_motion(kind):
    robot = paper_robot("none")
    q1, q3 = (np.array(robot.description.poses[name]) for name in ("Q1", "Q3"))
    fastest = min(robot.description.limits.velocity) * (q3 - q1) / np.abs(q3 - q1).max()
    for tick in range(900):
        if tick == 100:
            assert not refused(robot.send(c.SetShaper, name="zvddd"))
        if tick % 50 == 0 and kind == "servo_j":
            reply = robot.send(c.ServoJ, q=tuple(q3.tolist()), lookahead=0.03, gain=2000.0, shaped=True)
        elif tick % 50 == 0:
            qd = fastest if tick < 300 else 0.0 * fastest
            reply = robot.send(c.SpeedJ, qd=tuple(qd.tolist()), acceleration=40.0, shaped=True)
        assert isinstance(reply, Accepted), reply
        robot.tick()
    assert_kept(robot, torque=False)


@pytest.mark.parametrize("name", ["ur5e", "ur20"])
def test_a_move_that_is_planned_in_the_tick_keeps_the_limits_and_names_what_made_it_slowest(name):
    """It is slowed down by half for a torque, and then a little for a velocity."""
    arm = load(name)
    robot = Subject(arm, np.array(arm.poses["Q1"]), paper_payload(arm), shaper="zv")
    fields = {"velocity": min(arm.limits.velocity), "acceleration": 8.0, "jerk": 500.0}
    command = c.MoveJ(token=robot.token, q=arm.poses["Q3"], **fields)
    found = Planner(robot.controller.setup).plan(command, robot.controller.snapshot(), within_tick=True).found
    assert isinstance(found, PlannedMove)
    assert found.limited[0] == "limit_torque", found.limited
    robot.controller.motion.move(found)
    assert robot.until_rest()
    assert_kept(robot)
