"""Filter and payload changed while the arm moves: no step, nothing beyond the limits, atomic, deterministic."""

import numpy as np
import pytest

from tvist_controller.foresight.stopper import Stopper
from tvist_controller.line.differentiator import STILL
from tvist_controller.line.inverse_dynamics import SLEW, InverseDynamics
from tvist_controller.line.limits import TORQUE_SHARE
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_protocol.transitions import Activity
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.estimators.polynomial import Polynomial
from tvist_shaping.filter import TvistFilter

from .robots import FITTING, PAPER, POLYNOMIAL, Q1, Q2, Q3, UR5E, H, bits, calibration, without_arm
from .test_modes import at

DISC = paper_payload(UR5E)
TOLERANCE = 1e-6
"""Share of a limit that is rounding."""


def a_filter(random, name=None):
    estimator = Polynomial(**POLYNOMIAL)
    if random.random() < 0.5:
        estimator = Fixed([random.uniform(5.0, 15.0)], [random.uniform(0.02, 0.4)])
    return TvistFilter(shaper(name or random.choice(FITTING)), estimator, joints=6)


def a_line(tvist):
    line = without_arm()
    line.use(tvist)
    return line


class Alone:
    """The shaped references of filters that are fed what a line is fed, and the bounds they give."""

    def __init__(self, tvist):
        self.filters, self.shaped = [tvist.replace()], [[]]

    def add(self, tvist):
        other = tvist.replace()
        other.take_over(self.filters[-1])
        self.filters.append(other)
        self.shaped.append([])

    def feed(self, reference):
        for tvist, shaped in zip(self.filters, self.shaped, strict=True):
            shaped.append(tvist.filter(reference))

    def bound(self, order, limit, length):
        """Largest of the limit and what one of them gives, shape (length - order, n)."""
        bound = np.full((length - order, 6), float(limit))
        for shaped in self.shaped:
            if len(shaped) > order:
                own = np.abs(np.diff(shaped, order, axis=0)) / H**order
                bound[-len(own) :] = np.maximum(bound[-len(own) :], own)
        return bound


def drive(line, first, changes, limits, most=4000):
    """Run to rest with changes of the filter at their ticks; shaped reference and what was promised of it."""
    alone, shaped = Alone(first), []
    for tick in range(most):
        if tick in changes:
            alone.add(changes[tick])
            line.use(changes[tick])
        line.step()
        alone.feed(line.reference)
        shaped.append(line.position)
        if line.at_rest:
            break
    shaped = np.array(shaped)
    for order, limit in ((1, limits.velocity), (2, limits.acceleration)):
        own = np.abs(np.diff(shaped, order, axis=0)) / H**order
        assert (own / alone.bound(order, limit, len(shaped))).max() < 1.0 + TOLERANCE
    return shaped


@pytest.mark.parametrize("seed", range(12))
def test_a_motion_keeps_its_limits_and_its_target_through_changes_of_the_filter(seed):
    random = np.random.default_rng(seed)
    first = a_filter(random)
    line = a_line(first)
    limits = PAPER if seed % 2 else MotionLimits(*random.uniform((0.5, 1.0, 50.0), (3.0, 8.0, 1000.0)))
    target = Q1 + random.uniform(-1.0, 1.0, 6) * random.uniform(0.1, 2.0)
    duration = line.begin(line.plan(target, limits)).duration
    ticks = np.sort(random.integers(0, int(duration / H), 3))
    changes = {int(tick): a_filter(random) for tick in ticks}
    shaped = drive(line, first, changes, limits)
    assert line.at_rest
    assert np.abs(shaped[-1] - target).max() <= STILL
    assert line.tvist is list(changes.values())[-1]
    for _ in range(20):
        line.step()
    assert (line.position == target).all()


def test_a_stream_at_its_limit_keeps_it_through_a_change():
    first, then = (TvistFilter(shaper(name), Fixed([7.0], [0.1]), joints=6) for name in ("zv", "ei"))
    line = a_line(first)
    stream = line.stream(H, PAPER)
    w, alone, shaped = 1.6, Alone(first), []
    way = np.array([1.0, -0.5, 0.3, 0.0, 0.0, 0.0])
    amplitude = PAPER.acceleration / w**2
    for k in range(2800):
        t = k * H
        q = Q1 + 0.99 * amplitude * min(1.0, t / 2.0) ** 3 * np.sin(w * t) * way * 0.75
        stream.offer(k, q)
        if k == 1500:
            alone.add(then)
            line.use(then)
        line.step()
        alone.feed(line.reference)
        shaped.append(line.position)
    shaped = np.array(shaped)
    own = np.abs(np.diff(shaped, 2, axis=0)) / H**2
    assert (own / alone.bound(2, PAPER.acceleration, len(shaped))).max() < 1.0 + TOLERANCE
    assert line.filter._fade is None
    line.begin(stream.end)
    while not line.at_rest:
        line.step()
    assert np.abs(line.position - line.reference).max() <= STILL


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
        assert robot.kinds().count("shaper_changed") == 2
    assert bits(robots[0].states) == bits(robots[1].states)
