"""Filter and payload changed while the arm moves: no step, nothing beyond the limits, atomic, deterministic."""

import numpy as np
import pytest

from tvist_controller.foresight.stopper import Stopper
from tvist_controller.line.inverse_dynamics import SLEW, InverseDynamics
from tvist_controller.line.limits import TORQUE_SHARE
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_protocol.transitions import Activity

from .robots import PAPER, Q1, Q2, Q3, UR5E, bits, calibration, without_arm
from .test_modes import at

DISC = paper_payload(UR5E)


@pytest.mark.parametrize("masses", [(5.0, 0.0), (1.0, 4.0)])
def test_another_payload_makes_no_step_in_torque_and_ends_as_if_it_had_always_been(masses):
    first, then = (body(paper_payload(UR5E, mass)) for mass in masses)
    changed, never, always = (without_arm() for _ in range(3))
    for line, payload in ((changed, first), (never, first), (always, then)):
        line.dynamics.declare(payload)
        line.reset(Q1)
        line.begin(line.plan(Q3, PAPER))
    torques = []
    for tick in range(700):
        if tick == 100:
            changed.dynamics.declare(then)
        torques.append([line.step().torque for line in (changed, never, always)])
    torque, old, new = np.swapaxes(np.array(torques), 0, 1)
    assert (torque[:100] == old[:100]).all()
    np.testing.assert_allclose(torque[100 + SLEW :], new[100 + SLEW :], atol=1e-9)
    # No tick's change is more than that of the motion and an even share of the difference, with half on top.
    ticks = slice(100, 100 + SLEW)
    most = np.maximum(np.abs(np.diff(old, axis=0)), np.abs(np.diff(new, axis=0)))
    most = most[ticks] + 1.6 * np.abs(new - old)[ticks].max(axis=0) / SLEW
    assert (np.abs(np.diff(torque, axis=0))[ticks] <= most + 1e-9).all()
    assert (torque >= np.minimum(old, new) - 1e-9).all()
    assert (torque <= np.maximum(old, new) + 1e-9).all()


@pytest.mark.parametrize("masses", [(5.0, 0.0), (0.0, 5.0)])
def test_a_stop_while_the_payload_changes_is_safe_with_either(masses):
    line = without_arm()
    line.dynamics.declare(body(paper_payload(UR5E, masses[0])))
    line.reset(Q1)
    line.begin(line.plan(Q2 + np.array([0.0, 0.4, 0.0, 0.0, 0.0, 0.0]), MotionLimits(2.5, 6.0, 500.0)))
    for tick in range(200):
        if tick == 150:
            line.dynamics.declare(body(paper_payload(UR5E, masses[1])))
        line.step()
    state, planned = line.newest, Stopper(line).plan_stop(None).trajectory
    for mass in masses:
        dynamics = InverseDynamics(UR5E, body(paper_payload(UR5E, mass)))
        present = line.dynamics.effort(state.q, state.qd, state.qdd)
        limit = np.maximum(TORQUE_SHARE * np.array(UR5E.limits.torque), present)
        states = planned.states(np.linspace(0.0, planned.duration, 49)[1:])
        assert (np.abs(dynamics.torques(*states)) <= limit + 1e-9).all()


CHANGES = [
    (c.SetShaper, {"name": "ei"}),
    (c.SetEstimator, {"name": "fixed", "f_d": (8.0,), "zeta": (0.2,)}),
    (c.SetPayload, {"mass": 1.0, "com": DISC.com, "inertia": DISC.inertia}),
]


@pytest.mark.parametrize(
    "activity", [Activity.MOVING, Activity.STREAMING, Activity.ENDING, Activity.STOPPING]
)
def test_changes_are_done_in_motion_and_the_same_every_time(activity):
    robots = [at(activity, calibration=calibration()) for _ in range(2)]
    for robot in robots:
        for kind, fields in CHANGES:
            assert robot.send(kind, **fields) == Done()
            robot.tick(20)
        if activity is Activity.STREAMING:
            robot.send(c.ServoStop)
        robot.until_rest()
        robot.tick(50)
        assert robot.states[-1].target_qd == pytest.approx([0.0] * 6, abs=1e-6)
        assert activity is not Activity.MOVING or robot.states[-1].target_q == pytest.approx(Q3, abs=1e-6)
        assert robot.kinds().count("shaper_changed") == 2
    assert bits(robots[0].states) == bits(robots[1].states)
