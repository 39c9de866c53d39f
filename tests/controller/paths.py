"""Robots that have just begun a random path, and how far along it they are in each tick."""

from dataclasses import dataclass

import numpy as np
from tests.search.subject import Subject, torques

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel
from tvist_controller.line.limits import TORQUE_SHARE
from tvist_controller.setup import body, paper_payload
from tvist_protocol import commands as c
from tvist_protocol.io import SetTcp
from tvist_protocol.motions import MovePath
from tvist_protocol.replies import Accepted, Done

from .robots import UR5E, H
from .spaces import TOOL, Leg, random_path, start_posture


@dataclass
class Journey:
    """A path that the robot accepts."""

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


def interfere(robot: Subject, random, longest: int, shapers) -> None:
    """Move the slider, pause, resume and change the filter at random, and let the motion go on in the end."""
    for _ in range(12):
        robot.tick(int(random.integers(1, longest)))
        match int(random.integers(4)):
            case 0:
                robot.send(c.SetSpeed, fraction=float(random.uniform(0.05, 1.0)))
            case 1:
                robot.send(c.Pause)
            case 2:
                robot.send(c.Resume)
            case _:
                assert robot.send(c.SetShaper, name=str(random.choice(shapers))) == Done()
    robot.send(c.Resume)
    robot.send(c.SetSpeed, fraction=1.0)


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
    present = np.abs(np.diff(free, 2, axis=0)).max() / H**2
    hardest = np.abs(np.diff(q, 2, axis=0)).max() / H**2
    assert hardest <= max(1.01 * min(UR5E.limits.acceleration), present), case
    assert CollisionModel(UR5E, body(payload)).nearest(q) >= CLEARANCE, case
