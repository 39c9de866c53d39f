"""Motions along curves, of which the wire has none yet: shaped, stopped, paused and changed, they stay on the curve.

Each runs through a whole controller; what it did is compared with the curve, and with the same motion left alone.
"""

import numpy as np
import pytest

from tvist_lab.safety import sequences
from tvist_lab.safety.sequences import Sequence
from tvist_lab.safety.stops import KINDS, PAUSES, SHAPERS
from tvist_lab.safety.subject import Subject, torques
from tvist_plant.description import Payload
from tvist_protocol import commands as c
from tvist_protocol import values
from tvist_protocol.replies import Accepted, Done
from tvist_server.ahead import resting_after
from tvist_server.collision import CollisionModel
from tvist_server.planning.filter_planner import FilterPlanner
from tvist_server.planning.move_planner import MovePlanner
from tvist_server.refusal import RefusalError
from tvist_server.safety import TORQUE_SHARE
from tvist_server.setup import body, paper_payload
from tvist_server.trajectory import Bends, JointLine, Limits, quickest_motion

from .curves import Arc, progress, random_arc, tool_circle
from .robots import PAPER, Q1, Q2, UR5E, H
from .robots import setup as robot_setup

DISC = paper_payload(UR5E, 5.0)
ON = 1e-9
"""Distance from a curve that is none [rad]."""
BACK = 1e-6
"""By so much interpolation in the filter may undershoot where a motion hardly moves, on straight lines too [rad]."""
EXCESS = 1.01
"""Share of a limit that a filter whose weights vary may reach [-]."""
POSITIVE = [name for name in SHAPERS if not name.startswith("um_")]


def free(curve) -> bool:
    return CollisionModel(UR5E, body(DISC)).on_way(curve.whole) is None


def curve_of(seed: int):
    """A tool circle now and then, else an arc that is clear."""
    random = np.random.default_rng([seed, 3])
    if seed % 4 == 0:
        return tool_circle()
    while True:
        curve = random_arc(random)
        if free(curve):
            return curve


def moving(curve, shaper: str, limits: Limits, speed: float = 1.0) -> Subject:
    """A robot that has just begun a motion along a curve."""
    robot = Subject(UR5E, curve.posture(curve.start), DISC, shaper=shaper)
    robot.send(c.SetSpeed, fraction=speed)
    start(robot, curve, limits)
    return robot


def start(robot: Subject, curve, limits: Limits = PAPER) -> None:
    setup = robot_setup(payload=DISC)
    basis = robot.controller.basis.motion
    planned = MovePlanner(setup, FilterPlanner(setup)).along(curve, limits, basis)
    robot.controller.motion.move(planned)


def played(robot: Subject, ticks: int = 200) -> np.ndarray:
    """All references until it rests, and some more ticks."""
    robot.until_rest()
    robot.tick(ticks)
    return np.array(robot.references)


def random_limits(random) -> Limits:
    return Limits(
        float(random.uniform(0.5, 3.14)),
        float(random.uniform(1.0, 8.0)),
        float(random.choice([100.0, 500.0, 2000.0])),
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_motion_along_a_curve_keeps_the_joints_limits_and_ends_exactly(seed):
    curve, limits = curve_of(seed), random_limits(np.random.default_rng(seed))
    motion, q = quickest_motion(curve, limits, H), [curve.posture(curve.start)] * 4
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
    motion = quickest_motion(path, PAPER, H)
    assert motion.share == 0.0
    for _ in range(300):
        motion.next()
    assert motion.time_at(motion.share) == pytest.approx(300 * H, abs=1e-9)
    assert motion.time_at(0.5) == pytest.approx(0.5 * motion.duration, abs=1e-6)
    while not motion.finished:
        motion.next()
    assert motion.share == 1.0


@pytest.mark.parametrize(
    ("length", "bends"),
    [
        (0.0, Bends(np.ones(6), 1.0, 1.0)),
        (1.0, Bends(2.0 * np.ones(6), 1.0, 1.0)),
        (1.0, Bends(np.ones(6), np.inf, 1.0)),
    ],
)
def test_a_curve_whose_bounds_make_no_sense_is_refused(length, bends):
    class Any(Arc):
        def __init__(self):
            super(Arc, self).__init__(length, bends)

    with pytest.raises(ValueError, match=r"length|slope|second"):
        Any()


@pytest.mark.parametrize("shaper", SHAPERS)
@pytest.mark.parametrize("seed", [0, 1])
def test_shaped_it_stays_on_the_curve_within_the_limits_and_rests_at_its_end(shaper, seed):
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
    tvist, motion, off = robot.controller.cycle.tvist.fork(), quickest_motion(curve, PAPER, H), []
    tvist.reset(curve.posture(curve.start))
    while not motion.finished:
        off.append(tvist.filter(curve.posture(motion.next())))
    assert progress(curve, np.array(off))[1] > 1e-4


@pytest.mark.parametrize("seed", range(40))
def test_every_kind_of_stop_stays_on_the_curve_behind_the_motion_and_rests_no_later(seed):
    random, curve = np.random.default_rng([seed, 5]), curve_of(seed)
    limits, shaper = random_limits(random), str(random.choice(SHAPERS))
    speed = float(random.choice([1.0, 1.0, random.uniform(0.1, 1.0)]))
    kind = str(random.choice(list(KINDS)))
    alone = played(moving(curve, shaper, limits, speed))
    moment = int(random.integers(1, max(resting_after(alone), 2)))
    robot = moving(curve, shaper, limits, speed)
    robot.tick(moment)
    KINDS[kind](robot, random)
    stopped = played(robot)
    longest = max(len(alone), len(stopped))
    alone, stopped = (np.vstack([q, np.repeat(q[-1:], longest - len(q), axis=0)]) for q in (alone, stopped))
    (free_shares, _), (shares, off) = progress(curve, alone), progress(curve, stopped)
    case = (seed, kind, shaper, moment, limits)
    assert off < ON, case
    assert (shares - free_shares)[moment:].max() <= ON, case
    assert resting_after(stopped) <= resting_after(alone), case
    most = TORQUE_SHARE * np.array(UR5E.limits.torque)
    asked, taken = (np.abs(torques(UR5E, DISC, q[moment - 1 :])).max(axis=0) for q in (alone, stopped))
    assert (taken / np.maximum(most, asked)).max() <= 1.001, case
    # A stop keeps the limits of the joints; whoever paused goes on within those of the motion.
    hardest = np.abs(np.diff(stopped[moment - 2 :], 2, axis=0)).max() / H**2
    present = np.abs(np.diff(alone, 2, axis=0)).max() / H**2
    assert hardest <= max(EXCESS * min(UR5E.limits.acceleration), present), case
    if kind not in PAUSES:
        event = next(event for event in robot.events if event.kind == "motion_stopped")
        if event.duration is not None:
            lasted = (resting_after(stopped) - moment) * H
            assert event.duration == pytest.approx(max(lasted, 0.0), abs=3 * H), case


def test_stops_of_curves_are_stops_and_not_only_the_motion_let_run_out():
    sooner = []
    for seed in range(1, 12):
        curve = curve_of(seed)
        alone = resting_after(played(moving(curve, "zv", PAPER)))
        robot = moving(curve, "zv", PAPER)
        robot.tick(alone // 3)
        robot.send(c.Stop)
        sooner.append(1.0 - resting_after(played(robot)) / alone)
    assert min(sooner) > 0.3


class OnCurves(Sequence):
    """Random commands as ever, of which every second move goes along a curve."""

    curve = None

    def move(self):
        motion = self.robot.controller.basis.motion
        if motion is None or self._random.random() < 0.5:
            reply = super().move()
            self.curve = None if isinstance(reply, Accepted) else self.curve
            return reply
        for _ in range(20):
            curve = random_arc(self._random, motion.q)
            if (np.abs(curve.posture(curve.end)) < np.array(UR5E.limits.position)).all():
                break
        try:
            start(self.robot, curve, Limits(**self._limits()))
        except RefusalError as refusal:
            return refusal.reply
        self.curve = curve
        return None

    def _watch_way(self, ahead, q):
        if self.curve is None:
            super()._watch_way(ahead, q)
            return
        tick = self.robot.controller.tick_number - ahead.since
        there = ahead.references[min(tick, len(ahead.references) - 1)]
        (reached, bound), off = progress(self.curve, np.array([q, there]))
        creeps = 1e-6 if tick >= len(ahead.references) else 0.0
        if off > ON:
            raise self._broken("a stop leaves the curve")
        if reached > bound + ON + creeps:
            raise self._broken("a stop is ahead of what the motion along a curve would have done")
        if tick > len(ahead.references) + 1 and not self.robot.resting:
            raise self._broken("a stop lasts longer than the motion along a curve would have")


@pytest.mark.parametrize("number", range(12))
def test_whatever_is_sent_the_promises_hold_on_curves(number, monkeypatch):
    monkeypatch.setitem(sequences._SENT, "move", (14.0, OnCurves.move))
    OnCurves(UR5E, number).run()


@pytest.mark.parametrize("seed", range(8))
def test_slider_pauses_and_changes_of_the_filter_stay_on_the_curve_and_lead_to_its_end(seed):
    random, curve = np.random.default_rng([seed, 7]), curve_of(seed)
    limits = random_limits(random)
    robot = moving(curve, str(random.choice(POSITIVE)), limits)
    for _ in range(12):
        robot.tick(int(random.integers(1, 120)))
        match int(random.integers(4)):
            case 0:
                robot.send(c.SetSpeed, fraction=float(random.uniform(0.05, 1.0)))
            case 1:
                robot.send(c.Pause)
            case 2:
                robot.send(c.Resume)
            case _:
                assert robot.send(c.SetShaper, name=str(random.choice(POSITIVE))) == Done()
    robot.send(c.SetSpeed, fraction=1.0)
    robot.send(c.Resume)
    q = played(robot)
    shares, off = progress(curve, q)
    assert off < ON
    assert (np.diff(shares) > -BACK).all()
    assert (q[-1] == curve.posture(curve.end)).all()
    for order, limit in ((1, limits.velocity), (2, limits.acceleration)):
        assert np.abs(np.diff(q, order, axis=0)).max() / H**order <= EXCESS * limit + 0.03


def over_the_floor():
    """An arc whose ends are clear, and the straight line between them too, while the arc passes through the floor."""
    lowest = np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0])
    aside = np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    start = np.array([0.0, -0.5, 0.3, -1.5, -1.5, 0.0])
    return Arc(start, -aside, lowest, 0.6, np.pi)


def test_a_curve_that_meets_something_on_its_way_is_refused_with_the_moment():
    curve = over_the_floor()
    model = CollisionModel(UR5E, Payload())
    ends = curve.posture(curve.start), curve.posture(curve.end)
    assert model.on_way(JointLine(*ends).whole) is None
    share, meeting = model.on_way(curve.whole)
    assert model.meeting(curve.posture(share * curve.end)) is not None
    robot = Subject(UR5E, ends[0], paper_payload(UR5E, 0.0))
    time = quickest_motion(curve, PAPER, H).time_at(share)
    with pytest.raises(
        RefusalError, match=f"{meeting.first} and {meeting.second} .* {time:.1f}. s after the start"
    ):
        start(robot, curve)
    assert robot.controller.cycle.at_rest


def test_a_payload_that_would_meet_something_on_the_rest_of_the_curve_is_refused():
    """It would where the curve goes, and not on the straight line to its end."""
    curve = Arc(
        np.array([0.0, -0.5, 0.3, -1.5, -1.5, 0.0]),
        np.array([-0.8, 0.0, 0.0, 0.0, 0.0, 0.0]),
        np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0]) * 0.25,
        0.6,
        np.pi,
    )
    robot = Subject(UR5E, curve.posture(curve.start), paper_payload(UR5E, 0.0))
    start(robot, curve)
    robot.tick(100)
    q, x = robot.references[-1], robot.controller.cycle.along.position
    for far in np.linspace(0.05, 0.9, 40):
        fields = {"mass": 1.0, "com": (0.0, 0.0, float(far)), "inertia": (0.01, 0, 0, 0.01, 0, 0.01)}
        reply = robot.send(c.SetPayload, **fields)
        if reply != Done():
            break
    assert reply.code == "collision"
    model = CollisionModel(UR5E, body(values.Payload(**fields)))
    assert model.on_way(curve.way(x, curve.end)) is not None
    assert model.on_way(JointLine(q, curve.posture(curve.end)).whole) is None
    assert robot.controller.motion.collisions.on_way(curve.way(x, curve.end)) is None


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


def test_brakes_leave_the_curve_and_the_next_motion_begins_where_they_held():
    curve = curve_of(2)
    robot = moving(curve, "zv", Limits(3.0, 8.0, 2000.0))
    robot.tick(200)
    robot.send(c.SimulationInject, fault="power_loss")
    q = played(robot)
    assert np.abs(np.diff(q, axis=0)).max() < 4.0 * H
    held = q[-1]
    robot.send(c.SimulationInject, fault="normal")
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    back = Arc(held, -curve.u, curve.v, 0.3, 0.5)
    start(robot, back)
    assert progress(back, played(robot)[len(q) :])[1] < ON


def test_the_torque_that_a_curve_will_take_is_told_when_it_starts():
    """Fast round a bend with 5 kg stretched out: its own way asks for more than the shoulder has."""
    stretched = np.array([0.0, -0.9, 0.0, -1.57, 0.0, 0.0])
    curve = Arc(stretched, np.array([0.3, 0.0, 0, 0, 0, 0]), np.array([0.0, 1.0, 0, 0, 0, 0]), 0.7, 0.9)
    robot = Subject(UR5E, stretched, DISC, shaper="none")
    start(robot, curve, Limits(3.0, 16.0, 2000.0))
    told = [event for event in robot.controller.tick()[1] if event.code == "limit_torque"]
    q = played(robot)
    most = np.abs(torques(UR5E, DISC, q)).max(axis=0)
    assert bool(told) == bool((most > np.array(UR5E.limits.torque)).any())
    assert told
