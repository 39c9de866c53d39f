"""Stops and refusals of motions along curves, compared with the curve and with the same motion left alone."""

import numpy as np
import pytest
from tests.search.draws import SHAPERS
from tests.search.stops import KINDS, PAUSES
from tests.search.subject import Subject

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.foresight.line_copy import resting_after
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import JointLine, MotionLimits
from tvist_plant.description import Payload
from tvist_protocol import commands as c
from tvist_protocol import values
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject

from .curved import DISC, ON, curve_of, moving, played, random_limits, start
from .curves import Arc, progress
from .paths import keeps_limits
from .robots import PAPER, UR5E, H


@pytest.mark.parametrize(
    "seed", [*range(12), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(12, 72))]
)
def test_every_kind_of_stop_stays_on_the_curve_behind_the_motion_and_rests_no_later(seed):
    random, curve = np.random.default_rng([seed, 5]), curve_of(seed)
    limits, shaper = random_limits(random), SHAPERS[seed % len(SHAPERS)]
    speed = float(random.choice([1.0, 1.0, random.uniform(0.1, 1.0)]))
    kind = list(KINDS)[seed % len(KINDS)]
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
    since = max(moment - 2, 0)
    keeps_limits(stopped[since:], alone[since:], DISC, case)
    if kind not in PAUSES:
        event = next(event for event in robot.events if event.kind == "motion_stopped")
        if event.duration is not None:
            lasted = (resting_after(stopped) - moment) * H
            assert event.duration == pytest.approx(max(lasted, 0.0), abs=3 * H), case


def test_stops_of_curves_are_stops_and_not_only_the_motion_let_run_out():
    sooner = []
    for seed in range(1, 7):
        curve = curve_of(seed)
        alone = resting_after(played(moving(curve, "zv", PAPER)))
        robot = moving(curve, "zv", PAPER)
        robot.tick(alone // 3)
        robot.send(c.Stop)
        sooner.append(1.0 - resting_after(played(robot)) / alone)
    assert min(sooner) > 0.3


@pytest.mark.parametrize("wanted", [9.0, None])
def test_a_stop_keeps_every_joint_within_the_deceleration_that_it_tells(wanted):
    """The curve's own part of the acceleration counted: both are as large here as they get."""
    hardest = []
    for seed in (1, 2, 3, 5, 6, 7):
        curve = curve_of(seed)
        robot = moving(curve, "none", MotionLimits(3.14, 8.0, 2000.0))
        cycle = robot.controller.cycle
        while cycle.trajectory.share < 0.5:
            robot.tick()
        plan = robot.controller.motion.outlook.plan_stop(wanted)
        x = [cycle.along.published.q, cycle.along.position]
        while not plan.trajectory.finished:
            x.append(plan.trajectory.next())
        q = np.array([curve.posture(each) for each in x])
        hardest.append(np.abs(np.diff(q, 2, axis=0)).max() / H**2 / plan.acceleration)
    assert max(hardest) <= 1.0 + 1e-6
    assert max(hardest) > 0.6


def over_the_floor():
    """An arc whose ends are clear, and the straight line between them too, while the arc passes through the floor."""
    lowest = np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0])
    aside = np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    start = np.array([0.0, -0.5, 0.3, -1.5, -1.5, 0.0])
    return Arc(start, -aside, lowest, 0.6, np.pi)


def test_a_curve_that_meets_something_on_its_way_is_found():
    curve = over_the_floor()
    model = CollisionModel(UR5E, Payload())
    ends = curve.posture(curve.start), curve.posture(curve.end)
    assert model.on_way(JointLine(*ends).whole) is None
    share, _ = model.on_way(curve.whole)
    assert model.meeting(curve.posture(share * curve.end)) is not None


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


def test_brakes_leave_the_curve_and_the_next_motion_begins_where_they_held():
    curve = curve_of(2)
    robot = moving(curve, "zv", MotionLimits(3.0, 8.0, 2000.0))
    robot.tick(200)
    robot.send(SimulationInject, fault="power_loss")
    q = played(robot)
    assert np.abs(np.diff(q, axis=0)).max() < 4.0 * H
    held = q[-1]
    robot.send(SimulationInject, fault="normal")
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    back = Arc(held, -curve.u, curve.v, 0.3, 0.5)
    start(robot, back)
    assert progress(back, played(robot)[len(q) :])[1] < ON
