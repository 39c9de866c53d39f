"""Shaped references keep the limits of the arm's joints: velocity, acceleration and torque, with every shaper."""

import itertools

import numpy as np
import pytest
from tests.controller.extremes import ARMS, SHAPES, Extreme, accepted

from tvist_controller.dispatch.planner import Planner
from tvist_controller.line.limits import arm_limits
from tvist_controller.planning.move_planner import PlannedMove
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics
from tvist_protocol.motions import MoveL
from tvist_protocol.replies import Refused

QUICK = ("zv", "ei3", "um_zv", "auto")
USED = 0.985
"""Smallest share of a limit that a move uses which is slower for it [-]: its torque is taken for proportional to its
acceleration, of which a shaper makes less where its impulses overlap less.
"""


def moved(arm: str, shaper: str, seed: int) -> None:
    """A move at the limits is accepted as quick as the arm can follow it, and says what it is slower for."""
    robot = Extreme(arm, shaper, np.random.default_rng([seed, 30]))
    if not robot.known:
        return
    reply = robot.move()
    if not accepted(reply):
        assert reply.code == "collision", reply
        return
    robot.until_rest()
    ratios = robot.ratios()
    assert ratios.kept, (arm, shaper, seed, ratios)
    if reply.limited is not None:
        assert max(ratios.velocity, ratios.acceleration, ratios.torque) > USED, (reply.limited, ratios)


def streamed(arm: str, shaper: str, seed: int, seconds: float) -> None:
    random = np.random.default_rng([seed, 31])
    robot = Extreme(arm, shaper, random)
    if robot.known:
        robot.stream(seconds, float(random.choice([0.002, 0.002, 0.008, 0.02])))
        ratios = robot.ratios()
        assert ratios.in_motion, (arm, shaper, seed, ratios)


@pytest.mark.parametrize(
    ("arm", "shaper"),
    [(arm, QUICK[number % 4]) for number, arm in enumerate(ARMS)],
)
def test_moves_and_streams_at_all_limits_keep_them(arm, shaper):
    moved(arm, shaper, 1)
    streamed(arm, shaper, 1, 2.0)


@pytest.mark.parametrize(
    ("arm", "shaper", "seed"),
    [("seven joints", "none", 10), ("ur30", "auto-target", 15)],
)
def test_so_do_those_that_are_heavy_for_a_moment_or_hardly_lighter_when_slower(arm, shaper, seed):
    moved(arm, shaper, seed)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("arm", "shaper", "turn"),
    [(*pair, number % 8) for number, pair in enumerate(itertools.product(ARMS, SHAPES))],
)
def test_many_moves_and_streams_at_all_limits_keep_them(arm, shaper, turn):
    for seed in range(turn, 20, 8):
        moved(arm, shaper, seed)
    streamed(arm, shaper, turn % 4, 10.0)


@pytest.mark.parametrize("shaper", ["zv", "auto", "zvd"])
def test_a_line_of_the_tool_keeps_the_torques_as_well(shaper):
    robot = Extreme("ur5e, polynomials", "none", np.random.default_rng(4))
    q = (0.0, -0.55, 1.0, -2.02, -1.57, 0.0)
    robot.place(q)
    robot.send(c.SetShaper, name=shaper)
    x, y, z, *turn = robot.send(ForwardKinematics, q=q).pose
    reply = robot.send(MoveL, pose=(x, y, z + 0.25, *turn), velocity=3.0, acceleration=40.0, jerk=4000.0)
    assert accepted(reply), reply
    assert reply.limited.endswith("so that the torque of joint shoulder stays within 150 N m")
    robot.until_rest()
    assert robot.ratios().kept, robot.ratios()
    assert robot.ratios().torque > 0.99


@pytest.mark.parametrize("begin", ["move", "stream"])
def test_a_shaper_that_exceeds_more_slows_down_what_is_under_way(begin):
    robot = Extreme("ur5e, polynomials", "zv", np.random.default_rng([2, 30]))
    if begin == "stream":
        robot.stream(2.0, then="ei3")
    else:
        assert accepted(robot.move())
        for _ in range(100):
            robot.tick()
        robot.send(c.SetShaper, name="ei3")
        robot.until_rest()
    assert robot.ratios().in_motion, robot.ratios()


@pytest.mark.parametrize("kind", ["servo_j", "speed_j"])
def test_a_shaper_that_exceeds_more_slows_down_a_guided_motion(kind):
    robot = Extreme("ur5e, polynomials", "none", np.random.default_rng(7))
    q1, q3 = (np.array(robot.description.poses[name]) for name in ("Q1", "Q3"))
    robot.place(tuple(q1.tolist()))
    way = (q3 - q1) / np.abs(q3 - q1).max()
    for tick in range(900):
        if tick == 100:
            assert not isinstance(robot.send(c.SetShaper, name="zvddd"), Refused)
            cycle, arms = robot.controller.cycle, arm_limits(robot.description)
            limits, spared = cycle.trajectory.limits, cycle.line.filter.spared(arms)
            assert cycle.mode.shaped
            assert limits.velocity == spared.velocity < arms.velocity
            assert limits.acceleration == spared.acceleration < arms.acceleration
        if tick % 50 == 0 and kind == "servo_j":
            reply = robot.send(c.ServoJ, q=tuple(q3.tolist()), lookahead=0.03, gain=2000.0, shaped=True)
            assert accepted(reply), reply
        elif tick % 50 == 0:
            qd = (min(robot.limits.velocity) if tick < 300 else 0.0) * way
            reply = robot.send(c.SpeedJ, qd=tuple(qd.tolist()), acceleration=40.0, shaped=True)
            assert accepted(reply), reply
        robot.tick()
    assert robot.ratios().in_motion, robot.ratios()


def test_the_paper_s_motions_are_as_quick_as_asked():
    robot = Extreme("ur5e, polynomials", "zv", np.random.default_rng(0))
    target = robot.start + np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    reply = robot.send(c.MoveJ, q=tuple(target.tolist()))
    assert accepted(reply)
    assert reply.limited is None


@pytest.mark.parametrize("arm", ["ur5e, polynomials", "ur5e", "ur20"])
def test_a_move_that_is_planned_in_the_tick_keeps_the_limits_too(arm):
    for seed in range(3):
        robot = Extreme(arm, "zv", np.random.default_rng([seed, 33]))
        controller = robot.controller
        command = c.MoveJ(token=robot.token, q=tuple(robot.goal.tolist()), **robot.full())
        found = Planner(robot.setup).plan(command, controller.snapshot(), within_tick=True).found
        if isinstance(found, PlannedMove):
            controller.motion.move(found)
            robot.until_rest()
            assert robot.ratios().kept, (arm, seed, robot.ratios())


def test_a_move_names_the_limit_that_made_it_slowest():
    """Planned in the tick, it is slowed down by half for a torque, and then a little for a velocity."""
    robot = Extreme("ur5e", "zv", np.random.default_rng(0))
    robot.place(robot.description.poses["Q1"])
    command = c.MoveJ(
        token=robot.token, q=robot.description.poses["Q3"], velocity=3.1, acceleration=8.0, jerk=500.0
    )
    found = Planner(robot.setup).plan(command, robot.controller.snapshot(), within_tick=True).found
    assert found.limited[0] == "limit_torque", found.limited
