"""Stops, pauses and the speed slider on paths in space, compared with the same motion left alone."""

import numpy as np
import pytest
from tests.search.draws import SHAPERS
from tests.search.stops import KINDS, PAUSES

from tvist_controller.foresight.line_copy import resting_after
from tvist_protocol.commands import MoveJ, Pause, Resume, SetPayload, Stop
from tvist_protocol.motions import LineSegment, MoveL, MovePath
from tvist_protocol.replies import Accepted
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.transitions import Activity

from .paths import Progress, interfere, journey, keeps_limits
from .robots import UR5E, H
from .spaces import BENT, away, begun, errors, tool_pose

LEAD = 1e-8
"""A pause goes through a filter whose weights follow the posture, and so may lead by nanometres [m]."""


@pytest.mark.parametrize(
    "seed", [*range(12), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(12, 110))]
)
def test_every_kind_of_stop_stays_on_the_path_behind_the_motion_and_rests_no_later(seed):
    trip = journey([seed, 41], SHAPERS)
    random = np.random.default_rng([seed, 42])
    alone = Progress(trip.begin())
    alone.until_rest()
    alone.tick(200)
    free = np.array(alone.robot.references)
    moment = int(random.integers(1, max(resting_after(free), 2)))
    kind = str(random.choice(list(KINDS)))
    case = (seed, kind, trip.shaper, moment)
    stop = Progress(trip.begin())
    stop.tick(moment)
    stop.robot.events.clear()
    KINDS[kind](stop.robot, random)
    stop.until_rest()
    stop.tick(100)
    q = np.array(stop.robot.references)
    longest = max(len(free), len(q))
    covered, ahead = (np.pad(one.covered, (0, longest - len(one.covered)), "edge") for one in (stop, alone))
    assert (covered - ahead)[moment:].max() <= LEAD, case
    assert resting_after(q) <= resting_after(free), case
    off, turned = errors(q[:: max(len(q) // 200, 1)], trip.legs)
    assert off <= 5e-5, case
    assert turned <= 1e-4, case
    keeps_limits(q[moment - 1 :], free[moment - 1 :], trip.payload, case)
    if kind not in PAUSES:
        event = next(event for event in stop.robot.events if event.kind == "motion_stopped")
        if event.duration is not None:
            assert event.duration == pytest.approx(max(resting_after(q) - moment, 0) * H, abs=3 * H), case


@pytest.mark.parametrize("seed", range(5))
def test_slider_and_pauses_stay_on_the_path_and_lead_to_its_end(seed):
    trip = journey([seed, 43], [name for name in SHAPERS if not name.startswith("um_")])
    random = np.random.default_rng([seed, 44])
    robot = trip.begin()
    interfere(robot, random, 200, ["none", "zv", "zvd", "auto"])
    robot.until_rest(500_000)
    robot.tick(20)
    q = np.array(robot.references)
    off, turned = errors(q[:: max(len(q) // 300, 1)], trip.legs)
    assert off <= 5e-5
    assert turned <= 1e-4
    assert np.abs(np.diff(q, axis=0)).max() / H <= 1.01 * min(UR5E.limits.velocity)
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= 1.01 * min(UR5E.limits.acceleration)
    assert [event.kind for event in robot.events if event.kind in {"motion_done", "motion_stopped"}] == [
        "motion_done"
    ]


def two_parts(shaper: str = "zv"):
    """A robot that moves along a path that stops at its corner, and is about to come to rest there."""
    robot = begun(shaper=shaper)
    robot.send(
        MovePath, segments=tuple(LineSegment(pose=away(to)) for to in ((0.1, 0.0, 0.0), (0.1, 0.1, 0.0)))
    )
    cycle = robot.controller.cycle
    while cycle.trajectory.duration - cycle.trajectory.time > 0.02:
        robot.tick()
    return robot


@pytest.mark.parametrize("again", [Pause, SimulationInject])
def test_a_pause_between_two_parts_lasts_until_it_ends(again):
    """The first part is about to end, so it does; the pause then holds the arm at the corner."""
    robot = two_parts()
    robot.send(Pause)
    robot.tick(200)
    assert robot.controller.cycle.mode.at_rest
    assert robot.controller.motion.activity is Activity.PAUSED
    robot.send(again, **({"fault": "safeguard_stop"} if again is SimulationInject else {}))
    robot.tick(100)
    assert robot.controller.cycle.mode.at_rest
    robot.send(SimulationInject, fault="normal")
    robot.send(Resume)
    robot.until_rest()
    assert [event.kind for event in robot.events][-1] == "motion_done"


def test_a_payload_is_checked_on_the_parts_that_have_not_begun():
    robot = begun(shaper="none")
    position = tool_pose(BENT, (0.0,) * 6)[0]
    low = (0.0, 0.0, 0.2 - position[2])
    reply = robot.send(
        MovePath, segments=(LineSegment(pose=away((0.05, 0.0, 0.0))), LineSegment(pose=away(low)))
    )
    assert isinstance(reply, Accepted), reply
    robot.tick(40)
    robot.send(Pause)
    robot.tick(300)
    long = {"mass": 1.0, "com": (0.0, 0.0, 0.4), "inertia": (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)}
    assert robot.send(SetPayload, **long).code == "collision"


@pytest.mark.parametrize("kind", [MoveL, MoveJ])
def test_a_motion_slow_by_its_duration_is_paused_at_once(kind):
    robot = begun(shaper="zv")
    target = {"pose": away((0.05, 0.1, 0.0))} if kind is MoveL else {"q": tuple(BENT + 0.2)}
    assert isinstance(robot.send(kind, duration=300.0, **target), Accepted)
    robot.tick(5000)
    robot.send(Pause)
    robot.tick(150)
    before = robot.references[-1]
    robot.tick(200)
    assert np.abs(robot.references[-1] - before).max() < 1e-9
    robot.send(Resume)
    robot.tick(500)
    assert np.abs(robot.references[-1] - before).max() > 1e-5
    robot.send(Stop)
    robot.tick(200)
    assert robot.controller.cycle.mode.at_rest
    assert [event.kind for event in robot.events if event.id is not None][-1] == "motion_stopped"
