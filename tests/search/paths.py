"""Random motions of the tool, and stops, pauses and changes on them, compared with the same motion left alone."""

from dataclasses import dataclass

import numpy as np
import pytest
from tests.search.draws import SHAPERS
from tests.search.spaces import TOOL, UR5E, Leg, errors, random_path, start_posture, tool_pose
from tests.search.stops import KINDS, PAUSES
from tests.search.subject import Subject, speeds, torques

from tvist_controller.api.line import TORQUE_SHARE, CollisionModel, body, paper_payload, resting_after
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c
from tvist_protocol.io import SetTcp
from tvist_protocol.motions import MovePath
from tvist_protocol.replies import Accepted

FADE_ABOVE_LIMIT = 8
"""The case of `judge_changes` in which a fade exceeds a limit.

A motion along a path gives a fade one limit of speed: that of its fastest place. A fade to a shorter shaper, here from
`zvd` to `none`, catches up at that speed, also where the path turns a joint more. The joint has 1.03 of its velocity
limit for 64 ticks. Without a fade, each of the two shapers keeps the limit.
"""
LEAD = 1e-8
"""A pause goes through a filter whose weights follow the posture, and so may lead by nanometres [m]."""


@dataclass
class Journey:
    q: np.ndarray
    path: dict
    legs: list[Leg]
    mass: float
    shaper: str
    speed: float = 1.0

    @property
    def payload(self):
        return paper_payload(UR5E, self.mass)

    def begin(self) -> Subject | None:
        """A robot that has just accepted the path; None if it refuses it."""
        robot = Subject(UR5E, self.q, self.payload, shaper=self.shaper)
        robot.send(SetTcp, offset=TOOL)
        robot.send(c.SetSpeed, fraction=self.speed)
        return robot if isinstance(robot.send(MovePath, **self.path), Accepted) else None


def journey(seed, shapers) -> Journey:
    """The first path that is accepted, of those drawn from a seed."""
    random = np.random.default_rng(seed)
    while True:
        q = start_posture(random)
        path, legs = random_path(random, q)
        found = Journey(q, path, legs, float(random.choice([0.0, 1.0, 5.0])), str(random.choice(shapers)))
        if found.begin() is not None:
            found.speed = float(random.choice([1.0, 1.0, random.uniform(0.1, 1.0)]))
            return found


class Progress:
    """Length that the shaped reference has covered of the robot's path, tick by tick.

    Args:
        robot: A robot whose motion along a path has just begun.
    """

    def __init__(self, robot: Subject) -> None:
        self.robot = robot
        motions = robot.controller.motion.motions
        paths = [robot.controller.cycle.trajectory.path, *(part.path for part in motions.move.coming)]
        lengths = [float(path.end[0]) for path in paths]
        self._begun = dict(zip(map(id, paths), np.cumsum([0.0, *lengths]), strict=False))
        self._paths = paths  # kept, since their ids are used
        self.covered = [0.0]

    def tick(self, ticks: int = 1) -> None:
        cycle = self.robot.controller.cycle
        for _ in range(ticks):
            self.robot.tick()
            path = getattr(cycle.shaped.posture_of, "__self__", None)
            begun = self._begun.get(id(path))
            now = self.covered[-1] if begun is None else float(begun + cycle.along.position[0])
            self.covered.append(max(now, self.covered[-1]) if begun is None else now)

    def until_rest(self, most: int = 500_000) -> None:
        while not self.robot.resting:
            self.tick()
            assert len(self.covered) < most, "the motion does not end"


def keeps_limits(q, free, payload, case):
    """Torque, acceleration and clearance after a stop, in comparison with the motion that was left alone."""
    most = TORQUE_SHARE * np.array(UR5E.limits.torque)
    asked, taken = (np.abs(torques(UR5E, payload, each)).max(axis=0) for each in (free, q))
    assert (taken / np.maximum(most, asked)).max() <= 1.001, case
    present = np.abs(np.diff(free, 2, axis=0)).max() / PERIOD**2
    hardest = np.abs(np.diff(q, 2, axis=0)).max() / PERIOD**2
    assert hardest <= max(1.01 * min(UR5E.limits.acceleration), present), case
    collisions = CollisionModel(UR5E, body(payload))
    assert all(collisions.meeting(each) is None for each in q), case


def assert_on_path(q, legs):
    """The tool is on the legs of its path, by their geometry alone."""
    off, turned = errors(q[:: max(len(q) // 300, 1)], legs)
    assert off <= 5e-5
    assert turned <= 1e-4


def arrives_within_limits(robot, trip, most):
    """Let the motion end: the tool was on the path, within this share of the joints' limits, and is at its end."""
    robot.until_rest(500_000)
    robot.tick(20)
    q = np.array(robot.references)
    assert_on_path(q, trip.legs)
    assert max(speeds(UR5E, q)) <= most
    position, rotation = tool_pose(q[-1])
    end, turned_end = trip.legs[-1].end
    assert np.linalg.norm(position - end) <= 1e-6
    assert (rotation * turned_end.inv()).magnitude() <= 1e-6
    kinds = [event.kind for event in robot.events if event.kind.startswith("motion")]
    assert kinds == ["motion_started", "motion_done"]


def judge(seed):
    """Make a random path, and check that it is where it should be, within the limits, until its end."""
    trip = journey([seed, 31], [SHAPERS[seed % len(SHAPERS)]])
    arrives_within_limits(trip.begin(), trip, 1.0)


def judge_changes(seed):
    """Move the slider, pause, resume and change the shaper at random: it stays on the path, and comes to its end."""
    trip = journey([seed, 43], [name for name in SHAPERS if not name.startswith("um_")])
    random = np.random.default_rng([seed, 44])
    robot = trip.begin()
    changes = [
        lambda: robot.send(c.SetSpeed, fraction=float(random.uniform(0.05, 1.0))),
        lambda: robot.send(c.Pause),
        lambda: robot.send(c.Resume),
        lambda: robot.send(c.SetShaper, name=str(random.choice(["none", "zv", "zvd", "auto"]))),
    ]
    for _ in range(12):
        robot.tick(int(random.integers(1, 200)))
        changes[int(random.integers(4))]()
    robot.send(c.Resume)
    robot.send(c.SetSpeed, fraction=1.0)
    arrives_within_limits(robot, trip, 1.05 if seed == FADE_ABOVE_LIMIT else 1.01)


def judge_stop(seed):
    """Stop a random path in some way: it stays on the path, is not ahead of the motion, and rests no later."""
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
    assert_on_path(q, trip.legs)
    keeps_limits(q[moment - 1 :], free[moment - 1 :], trip.payload, case)
    if kind not in PAUSES:
        event = next(event for event in stop.robot.events if event.kind == "motion_stopped")
        if event.duration is not None:
            seconds = max(resting_after(q) - moment, 0) * PERIOD
            assert event.duration == pytest.approx(seconds, abs=3 * PERIOD), case
