"""Stops: their trajectories, and in mid-motion at random moments."""

import itertools
import re

import numpy as np
import pytest
from tests.search.stops import draw, judge

from tvist_controller.trajectory import JointLine, JointStop, MotionLimits, PathStop, quickest_motion
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import PAPER, Q1, Q2, Q3, ROUNDING, UR5E, H, Robot, calibration, stop, without_arm


def run(line, ticks):
    """Published targets of some ticks."""
    samples = [line.step() for _ in range(ticks)]
    return np.array([[s.target.q, s.target.qd, s.target.qdd] for s in samples])


def until_rest(line):
    out = []
    while not line.at_rest:
        out.append(run(line, 1)[0])
    return np.array(out)


@pytest.mark.parametrize("number", range(16))
def test_every_kind_of_stop_stays_on_the_way_behind_the_motion_and_rests_no_later(number):
    """Against the same motion left alone: on its line, at no tick further along it, no later, within the torque."""
    outcome = judge(UR5E, draw(UR5E, number))
    assert outcome.kept, outcome
    duration, way = outcome.told
    if duration is not None:
        assert duration == pytest.approx(outcome.duration, abs=3 * H), "the event says how long it takes"
        assert way == pytest.approx(outcome.way, abs=1e-6), "and how far it goes"


def test_a_stop_that_torque_would_let_go_through_the_floor_is_no_later_than_the_move():
    """Where no rung of decelerations keeps the torque, the move itself is the stop."""
    robot = Robot()
    robot.send(SimulationReset, q=(0.0, -1.57, 0.0, -1.57, 0.0, 0.0))
    limits = {"velocity": 3.14, "acceleration": 4.0, "jerk": 2000.0}
    target = (0.0, -0.2, 0.0, -1.57, 0.0, 0.0)
    lasted = []
    for end in (
        lambda: None,
        lambda: robot.controller.client_gone("a", "1f"),
        lambda: robot.send(SimulationInject, fault="protective_stop"),
        lambda: robot.send(c.PowerOff),
    ):
        robot.token = robot.controller.receive(c.TakeControl(client="a"), session="1f").token
        robot.send(SimulationReset, q=(0.0, -1.57, 0.0, -1.57, 0.0, 0.0), mode="RUNNING")
        started = robot.controller.tick_number
        assert isinstance(robot.send(c.MoveJ, q=target, **limits), Accepted)
        robot.tick(250)
        end()
        lasted.append(robot.until_rest().tick - started)
        assert max(state.target_q[1] for state in robot.states) <= target[1] + 1e-9
    assert max(lasted) == lasted[0]


def test_a_move_whose_torque_would_pass_a_limit_is_slower_and_says_so():
    robot = Robot()
    robot.send(c.SetShaper, name="none")
    robot.send(SimulationReset, q=(0.0, -0.9, 0.0, -1.57, 0.0, 0.0))
    reply = robot.send(
        c.MoveJ, q=(0.0, -0.3, 0.0, -1.57, 0.0, 0.0), velocity=3.0, acceleration=8.0, jerk=500.0
    )
    robot.until_rest()
    told = [event for event in robot.events if event.kind == "warning" and event.code == "limit_torque"]
    assert [event.why for event in told] == [reply.limited]
    assert re.fullmatch(
        r"acceleration is \S+ of 8 rad/s², so that the torque of joint shoulder stays within 150 N m",
        reply.limited,
    )
    most = np.abs(robot.column("target_moment")[:, 1]).max()
    assert 0.99 * UR5E.limits.torque[1] < most <= (1.0 + 1e-3) * UR5E.limits.torque[1]
    quiet = Robot()
    assert quiet.send(c.MoveJ, q=tuple(Q3)).limited is None
    assert "warning" not in quiet.kinds()


@pytest.mark.parametrize("name", ["zv", "ei3"])
def test_after_a_stop_a_move_is_what_it_is_of_a_fresh_line(name):
    line = without_arm(name)
    line.begin(line.plan(Q3, PAPER))
    run(line, 431)
    stop(line, None)
    end = until_rest(line)[-1, 0]
    run(line, 3)
    fresh = without_arm(name, q=end)
    for moved in (line, fresh):
        moved.begin(moved.plan(Q2, PAPER))
    assert (until_rest(line) == until_rest(fresh)).all()


def test_a_stop_while_the_shaper_lets_a_finished_trajectory_out_is_a_stop_too():
    line = without_arm("ei3")
    motion = line.begin(line.plan(Q1 + 0.1, PAPER))
    while not motion.finished:
        run(line, 1)
    assert not line.at_rest
    stop(line, None)
    end = until_rest(line)[-1, 0]
    assert (np.abs(end - (Q1 + 0.1)) > 1e-3).all()
    assert (run(line, 300)[:, 0] == end).all()


def test_a_harder_stop_takes_over_from_a_gentle_one():
    def way(*decelerations):
        line = without_arm()
        line.begin(line.plan(Q2, PAPER))
        run(line, 450)
        for deceleration in decelerations:
            stop(line, deceleration)
            run(line, 20)
        return until_rest(line)[-1, 0, 0]

    assert way(2.0, None) < way(2.0) - 0.1
    assert way(2.0, 1.0) == way(2.0)
    assert way(None, 1.0) == way(None)


def test_a_harder_stop_keeps_the_acceleration_within_its_limit():
    line = without_arm()
    line.begin(line.plan(Q2, PAPER))
    run(line, 450)
    stop(line, 2.0)
    run(line, 30)
    plan = stop(line, None)
    assert np.abs(until_rest(line)[:, 2]).max() <= plan.acceleration + ROUNDING


def test_a_repeated_stop_changes_nothing():
    def stopped(times):
        line = without_arm()
        line.begin(line.plan(Q2, PAPER))
        run(line, 300)
        out = []
        for _ in range(times):
            stop(line, None)
            out.append(run(line, 1)[0])
        return np.array([*out, *until_rest(line)])

    assert (stopped(1) == stopped(10)).all()


def test_the_trajectory_ends_at_rest_and_every_joint_as_soon_as_it_can():
    stop = JointStop(
        np.array([0.0, 1.0]), np.array([1.0, -0.1]), np.zeros(2), acceleration=10.0, jerk=1000.0, period=H
    )
    q, qd, qdd = stop.at(stop.duration)
    assert qd == pytest.approx([0, 0], abs=1e-12)
    assert qdd == pytest.approx([0, 0], abs=1e-9)
    assert stop.duration == pytest.approx(1.0 / 10.0 + 10.0 / 1000.0)
    slower_joint = stop.at(0.1 / 10.0 + 2 * 0.01)[0][1]
    assert slower_joint == pytest.approx(q[1], abs=1e-12)
    while not stop.finished:
        last = stop.next()
    assert (last == q).all()
    assert (stop.next() == q).all()
    assert stop.velocity == pytest.approx([0, 0], abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_a_stop_on_a_line_is_at_no_moment_ahead_of_any_motion_within_its_limits(seed):
    """Against the rest of a double S with lower limits, from a random moment of it."""
    random = np.random.default_rng(seed)
    limits = MotionLimits(random.uniform(0.5, 3.0), random.uniform(1.0, 8.0), random.uniform(50.0, 2000.0))
    motion, q = quickest_motion(JointLine(Q1, Q3), limits, H), [Q1, Q1]
    while not motion.finished:
        q.append(motion.next())
    q = np.array([*q, *[q[-1]] * 3])
    direction = (Q3 - Q1) / np.abs(Q3 - Q1).max()
    for moment in random.integers(3, len(q) - 4, 10):
        before, at, after = q[moment - 1 : moment + 2]
        qdd = (after - 2 * at + before) / H**2
        acceleration = random.uniform(1.0, 5.0) * limits.acceleration
        stop = PathStop(
            JointLine(Q1, Q3), after, after - at, qdd,
            acceleration=acceleration, braking=acceleration, jerk=2000.0, period=H,
        )  # fmt: skip
        ahead = q[moment + 2 :]
        stopped = np.array([stop.next() for _ in ahead])
        leading = int(np.argmax(np.abs(direction)))
        assert ((stopped - ahead)[:, leading] * direction[leading]).max() <= 1e-12
        off = stopped - Q1 - ((stopped - Q1)[:, leading] / direction[leading])[:, None] * direction
        assert np.abs(off).max() < 1e-14
        assert (
            np.abs(np.diff(stopped, 2, axis=0)).max() / H**2
            <= max(acceleration, np.abs(qdd).max()) + ROUNDING
        )


@pytest.mark.parametrize("name", ["um_zv", "um_zvd"])
@pytest.mark.parametrize("way", [0.003, 0.05, 0.6])
def test_with_negative_impulses_a_motion_is_done_only_where_nothing_more_comes_of_the_filter(name, way):
    """Their echoes cancel for a moment: a shaped reference that stands may go on."""
    robot = Robot()
    robot.send(c.SetEstimator, name="fixed", f_d=(5.0,), zeta=(0.05,))
    robot.send(c.SetShaper, name=name)
    robot.send(c.MoveJ, q=tuple(Q3 + way * (Q1 - Q3)) if way > 0.5 else tuple(Q1 + way))
    robot.until_rest()
    rested = robot.controller.cycle.position
    robot.tick(300)
    assert np.abs(robot.column("target_q")[-250:] - rested).max() < 1e-7


def test_a_pause_while_the_slider_slows_is_not_ahead_of_what_the_slider_would_have_done():
    def moving(command):
        robot = Robot()
        robot.send(c.SetShaper, name="mzv")
        robot.send(c.MoveJ, q=tuple(Q3), velocity=3.0, acceleration=33.0, jerk=2000.0)
        robot.tick(200)
        robot.send(c.SetSpeed, fraction=0.25)
        robot.tick(6)
        if command is not None:
            robot.send(command)
        robot.tick(600)
        return (robot.column("target_q") - Q1) @ (Q3 - Q1)

    assert (moving(c.Pause) - moving(None)).max() <= 1e-9


@pytest.mark.parametrize("name", ["um_zv", "um_zvd"])
def test_a_stop_is_not_ahead_of_a_motion_that_negative_impulses_let_turn_back(name):
    """Of a short move, at every other tick of it: its shaped reference goes forwards and back again."""
    target = (Q1[0] + 0.003, *Q1[1:])
    robot = Robot()
    robot.send(c.SetEstimator, name="fixed", f_d=(5.0,), zeta=(0.1,))
    robot.send(c.SetShaper, name=name)
    for moment in range(8, 80, 2):
        robot.send(SimulationReset, q=tuple(Q1), mode="RUNNING")
        robot.tick(3)
        assert isinstance(robot.send(c.MoveJ, q=target, velocity=0.5, acceleration=2.0, jerk=50.0), Accepted)
        robot.tick(moment)
        if robot.controller.cycle.mode.at_rest:
            break
        free = robot.controller.motion.stopper.foresee()[2:, 0]
        robot.send(c.Stop)
        stopped = []
        for _ in free:
            robot.tick()
            stopped.append(robot.controller.cycle.position[0])
        assert (np.array(stopped) - free).max() <= 1e-9, moment
    assert moment > 20


@pytest.mark.parametrize(
    "shaper", ["none", "zv", "ei3", "auto", "auto-target", "short", "elastic", "elastic-auto"]
)
def test_a_move_that_has_barely_begun_stands_as_soon_as_it_is_stopped(shaper):
    for ticks, deceleration in zip(range(12), itertools.cycle([None, 1.0]), strict=False):
        robot = Robot(shaper=shaper, calibration=calibration())
        robot.send(c.MoveJ, q=tuple(Q3.tolist()))
        robot.tick(ticks)
        before = robot.controller.cycle.position
        robot.send(c.Stop, deceleration=deceleration)
        stopped = robot.controller.tick_number
        assert robot.until_rest().tick - stopped <= 25
        assert np.abs(robot.controller.cycle.position - before).max() < 1e-3
