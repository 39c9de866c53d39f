"""Motions along curves: shaped, paused and with another filter they stay on the curve, within the limits."""

import numpy as np
import pytest
from tests.search.draws import SHAPERS
from tests.search.subject import Subject, torques

from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_controller.trajectory.spline import Knots, SplineCurve
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted

from .curved import BACK, DISC, EXCESS, ON, POSITIVE, curve_of, moving, played, random_limits, start
from .curves import Arc, progress, quickest_on, tool_circle
from .paths import interfere
from .robots import PAPER, Q1, Q2, UR5E, H


@pytest.mark.parametrize("seed", range(12))
def test_a_motion_along_a_curve_keeps_the_joints_limits_and_ends_exactly(seed):
    curve, limits = curve_of(seed), random_limits(np.random.default_rng(seed))
    motion, q = quickest_on(curve, limits), [curve.posture(curve.start)] * 4
    while not motion.finished:
        q.append(curve.posture(motion.next()))
    assert (q[-1] == curve.posture(curve.end)).all()
    q = np.array([*q, *[q[-1]] * 4])
    for order, limit in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
        # Rounding of ruckig's polynomials is worth some 1e-15 rad.
        assert np.abs(np.diff(q, order, axis=0)).max() <= limit * H**order * (1.0 + 1e-6) + 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_bounds_of_a_curve_hold_for_its_derivatives(seed):
    """Against finite differences of the posture."""
    curve = curve_of(seed)
    s, step = np.linspace(0.0, curve.end[0], 2000), 1e-4
    q = [curve.derivatives(s + number * step)[0] for number in (-2, -1, 0, 1, 2)]
    slope, second = (q[3] - q[1]) / (2 * step), (q[3] - 2 * q[2] + q[1]) / step**2
    third = (q[4] - 2 * q[3] + 2 * q[1] - q[0]) / (2 * step**3)
    _, own_slope, own_second = curve.derivatives(s)
    np.testing.assert_allclose(slope, own_slope, atol=1e-5)
    np.testing.assert_allclose(second, own_second, atol=1e-2)
    assert (np.abs(slope).max(axis=0) <= curve.bends.slope + 1e-6).all()
    assert np.abs(second).max() <= curve.bends.second * 1.001 + 1e-6
    assert np.abs(third).max() <= curve.bends.third * 1.01 + 1e-2


@pytest.mark.parametrize("path", [JointLine(Q1, Q2), tool_circle()])
def test_a_motion_says_when_a_share_of_its_way_is_done(path):
    motion = quickest_motion(path, PAPER, H) if isinstance(path, JointLine) else quickest_on(path, PAPER)
    assert motion.share == 0.0
    for _ in range(300):
        motion.next()
    assert motion.time_at(motion.share) == pytest.approx(300 * H, abs=1e-9)
    assert motion.time_at(0.5) == pytest.approx(0.5 * motion.duration, abs=1e-6)
    while not motion.finished:
        motion.next()
    assert motion.share == 1.0


@pytest.mark.parametrize(
    ("s", "slope", "second"), [((0.0, 0.0), 1.0, 0.0), ((0.0, 1.0), 0.0, 0.0), ((0.0, 1.0), 1.0, np.inf)]
)
def test_a_curve_whose_knots_make_no_sense_is_refused(s, slope, second):
    knots = Knots(np.array(s), np.zeros((2, 6)), np.full((2, 6), slope), np.full((2, 6), second))
    with np.errstate(all="ignore"), pytest.raises(ValueError, match=r"length|slope|second"):
        SplineCurve(knots)


@pytest.mark.parametrize(
    ("seed", "shaper"),
    [(number % 2, name) for number, name in enumerate(SHAPERS)]
    + [pytest.param(1 - number % 2, name, marks=pytest.mark.nightly) for number, name in enumerate(SHAPERS)],
)
def test_shaped_it_stays_on_the_curve_within_the_limits_and_rests_at_its_end(seed, shaper):
    curve, random = curve_of(seed), np.random.default_rng([seed, len(shaper)])
    limits = random_limits(random)
    robot = moving(curve, shaper, limits)
    q = played(robot)
    shares, off = progress(curve, q)
    assert off < ON
    if shaper in POSITIVE:
        assert (np.diff(shares) > -BACK).all()
        fastest, hardest = (np.abs(np.diff(q, order, axis=0)).max() / H**order for order in (1, 2))
        assert fastest <= EXCESS * limits.velocity
        assert hardest <= EXCESS * limits.acceleration + 0.03  # at rest counts from 1e-7 rad a tick
    assert (q[-1] == curve.posture(curve.end)).all()
    assert [event.kind for event in robot.events if event.kind.startswith("motion")] == [
        "motion_started",
        "motion_done",
    ]


def test_to_filter_the_joints_would_cut_the_corner():
    """What the parameter is shaped for: the same filter, joint by joint, leaves the curve by far more than rounding."""
    curve = tool_circle()
    robot = moving(curve, "zv", PAPER)
    tvist, motion, off = robot.controller.cycle.tvist.fork(), quickest_on(curve, PAPER), []
    tvist.reset(curve.posture(curve.start))
    while not motion.finished:
        off.append(tvist.filter(curve.posture(motion.next())))
    assert progress(curve, np.array(off))[1] > 1e-4


@pytest.mark.parametrize("seed", range(5))
def test_slider_pauses_and_changes_of_the_filter_stay_on_the_curve_and_lead_to_its_end(seed):
    random, curve = np.random.default_rng([seed, 7]), curve_of(seed)
    limits = random_limits(random)
    robot = moving(curve, str(random.choice(POSITIVE)), limits)
    interfere(robot, random, 120, POSITIVE)
    q = played(robot)
    shares, off = progress(curve, q)
    assert off < ON
    assert (np.diff(shares) > -BACK).all()
    assert (q[-1] == curve.posture(curve.end)).all()
    for order, limit in ((1, limits.velocity), (2, limits.acceleration)):
        assert np.abs(np.diff(q, order, axis=0)).max() / H**order <= EXCESS * limit + 0.03


def test_after_a_curve_a_move_is_what_it_is_of_a_fresh_robot():
    curve = curve_of(1)
    after = moving(curve, "zv", PAPER)
    played(after, 3)
    fresh = Subject(UR5E, curve.posture(curve.end), DISC, shaper="zv")
    ways = []
    for robot in (after, fresh):
        begun = len(robot.references)
        assert isinstance(robot.send(c.MoveJ, q=tuple(Q1.tolist())), Accepted)
        ways.append(played(robot)[begun:])
    assert (ways[0] == ways[1]).all()


def test_a_curve_takes_no_more_torque_than_there_is_and_says_so_when_it_starts():
    """Fast round a bend with 5 kg stretched out: as asked, it would take more than the shoulder has."""
    stretched = np.array([0.0, -0.9, 0.0, -1.57, 0.0, 0.0])
    curve = Arc(stretched, np.array([0.3, 0.0, 0, 0, 0, 0]), np.array([0.0, 1.0, 0, 0, 0, 0]), 0.7, 0.9)
    robot = Subject(UR5E, stretched, DISC, shaper="none")
    start(robot, curve, MotionLimits(3.0, 16.0, 2000.0))
    told = [event for event in robot.controller.tick()[1] if event.code == "limit_torque"]
    q = played(robot)
    most = np.abs(torques(UR5E, DISC, q)).max(axis=0)
    assert told
    assert 0.99 < (most / np.array(UR5E.limits.torque)).max() <= 1.0 + 1e-3
