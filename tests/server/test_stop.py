"""Stops: the trajectory itself, and in mid-motion at two hundred random moments."""

import numpy as np
import pytest
import ruckig

from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.safety import GENTLEST_STOP, TORQUE_SHARE
from tvist_server.setup import body, paper_payload
from tvist_server.trajectory import Stop

from .robots import FITTING, PAPER, Q1, Q2, Q3, ROUNDING, UR5E, H, cycle, without_arm

MOMENTS = 20
"""A shaper; 220 in all."""
JERK = min(UR5E.limits.jerk)


def direct_way(q, qd, qdd, acceleration):
    """How far ruckig's velocity interface goes to rest from a state, joint by joint."""
    way = []
    for position, velocity, present in zip(q, qd, qdd, strict=True):
        request, trajectory = ruckig.InputParameter(1), ruckig.Trajectory(1)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.current_position, request.current_velocity = [position], [velocity]
        request.current_acceleration = [present]
        request.target_velocity, request.target_acceleration = [0.0], [0.0]
        request.max_acceleration, request.max_jerk = [acceleration], [JERK]
        ruckig.Ruckig(1).calculate(request, trajectory)
        way.append(trajectory.at_time(trajectory.duration)[0][0] - position)
    return np.array(way)


def run(line, ticks):
    """Published targets of some ticks."""
    samples = [line.step() for _ in range(ticks)]
    return np.array([[s.target.q, s.target.qd, s.target.qdd] for s in samples])


def until_rest(line):
    out = []
    while not line.at_rest:
        out.append(run(line, 1)[0])
    return np.array(out)


@pytest.mark.parametrize("name", FITTING)
def test_a_stop_in_mid_motion_is_direct_and_final(name):
    """Of a shaped move, at random moments; all from the shaped reference's own (q*, q̇*, q̈*).

    Travel: no more than that of a direct limited stop from the state by central differences, plus a tick's.
    Acceleration: a second difference is a mean of acceleration over two ticks, so no more than the larger of the
    stop's own limit and what the motion had, to rounding. Torque: within its share, but for 2 % between the
    samples that the plan looks at, or no more than the motion already took.
    """
    random = np.random.default_rng(FITTING.index(name))
    dynamics = InverseDynamics(UR5E, body(paper_payload(UR5E)))
    share = TORQUE_SHARE * np.array(UR5E.limits.torque)
    line = without_arm(cycle(name))
    line.start(line.plan(Q3, PAPER))
    undisturbed = until_rest(line)
    for moment in random.integers(2, len(undisturbed) - 2, MOMENTS):
        line.reset(Q1)
        line.start(line.plan(Q3, PAPER))
        run(line, moment)
        # The newest reference is published one tick later.
        q, qd, qdd = undisturbed[moment]
        plan = line.stop(None)
        stopped = until_rest(line)
        end = stopped[-1, 0]

        assert (np.abs(stopped[0, 0] - q) == 0.0).all(), "the stop begins at the shaped reference"
        allowed = np.abs(direct_way(q, qd, qdd, plan.acceleration))
        tick = np.abs(qd) * H + 0.5 * np.abs(qdd) * H**2
        assert (np.abs(end - q) <= allowed + tick + 1e-9).all()
        had = np.abs(undisturbed[moment - 1 : moment + 1, 2]).max(axis=0)
        assert (np.abs(stopped[:, 2]) <= np.maximum(plan.acceleration, had) + ROUNDING).all()
        taken = np.abs([dynamics.torque(*target) for target in stopped])
        most = np.maximum(share, np.abs(dynamics.torque(q, qd, qdd)))
        assert plan.acceleration == GENTLEST_STOP or (taken <= 1.02 * most).all()
        assert (run(line, 100)[:, 0] == end).all(), "nothing in the buffer carries the arm further"


@pytest.mark.parametrize("name", ["zv", "ei3"])
def test_after_a_stop_a_move_is_what_it_is_of_a_fresh_line(name):
    line = without_arm(cycle(name))
    line.start(line.plan(Q3, PAPER))
    run(line, 431)
    line.stop(None)
    end = until_rest(line)[-1, 0]
    run(line, 3)
    fresh = without_arm(cycle(name, q=end))
    for moved in (line, fresh):
        moved.start(moved.plan(Q2, PAPER))
    assert (until_rest(line) == until_rest(fresh)).all()


def test_a_stop_while_the_shaper_lets_a_finished_trajectory_out_is_a_stop_too():
    line = without_arm(cycle("ei3"))
    motion = line.start(line.plan(Q1 + 0.1, PAPER))
    while not motion.finished:
        run(line, 1)
    assert not line.at_rest
    line.stop(None)
    end = until_rest(line)[-1, 0]
    assert (np.abs(end - (Q1 + 0.1)) > 1e-3).all()
    assert (run(line, 300)[:, 0] == end).all()


def test_a_harder_stop_takes_over_from_a_gentle_one():
    def way(*decelerations):
        line = without_arm(cycle())
        line.start(line.plan(Q2, PAPER))
        run(line, 450)
        for deceleration in decelerations:
            line.stop(deceleration)
            run(line, 20)
        return until_rest(line)[-1, 0, 0]

    assert way(2.0, None) < way(2.0) - 0.1
    assert way(2.0, 1.0) == way(2.0)
    assert way(None, 1.0) == way(None)


def test_a_harder_stop_keeps_the_acceleration_within_its_limit():
    line = without_arm(cycle())
    line.start(line.plan(Q2, PAPER))
    run(line, 450)
    line.stop(2.0)
    run(line, 30)
    plan = line.stop(None)
    assert np.abs(until_rest(line)[:, 2]).max() <= plan.acceleration + ROUNDING


def test_a_repeated_stop_changes_nothing():
    def stopped(times):
        line = without_arm(cycle())
        line.start(line.plan(Q2, PAPER))
        run(line, 300)
        out = []
        for _ in range(times):
            line.stop(None)
            out.append(run(line, 1)[0])
        return np.array([*out, *until_rest(line)])

    assert (stopped(1) == stopped(10)).all()


def test_the_trajectory_ends_at_rest_and_every_joint_as_soon_as_it_can():
    stop = Stop(
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


def test_a_stop_at_rest_is_over_at_once():
    stop = Stop(Q1, np.zeros(6), np.zeros(6), acceleration=1.0, jerk=100.0, period=H)
    assert stop.finished
    assert (stop.next() == Q1).all()
