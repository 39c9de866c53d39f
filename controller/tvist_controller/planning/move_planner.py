"""Planning of point-to-point motions, with checks for collisions and torque."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel, Meeting
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.planning.course import Course
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import Fitter, Slower, keeping_motion
from tvist_controller.planning.slower import Limited, longer_joint_motion, slower_joint_motion
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import (
    JointLine,
    MotionLimits,
    Path,
    PlannedMotion,
    Way,
    at_least,
    quickest_motion,
)
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ

AGILE = MotionLimits(1.5, 2.0, 100.0)
"""Limits of pauses and changes of the speed for motions that are slower by themselves: those of `move_j` by default."""


class PlannedMove(NamedTuple):
    """A motion that may begin."""

    parts: tuple[PlannedMotion, ...]
    """Trajectories of its reference, each from rest to rest, in their order."""
    velocity: float
    """Largest velocity of any joint [rad/s]."""
    limited: Limited | None
    """The limit that made it slower than asked, or that it will exceed, with a sentence; None if there is none."""
    skipped: tuple[str, ...] = ()
    """A sentence for each blend that is left out."""
    window: float = math.inf
    """Longest delay of a shaper with which the limits hold at full rate [s]."""
    marks: tuple[tuple[int, float], ...] = ()
    """For each segment of a path, the part of the motion and the length on it where the blend at the segment's end
    begins, or where the segment ends without one [m]."""
    peak: float = math.inf
    """Largest `Filter.peak` with which they do [-]."""
    room: tuple[float, float] = (math.inf, math.inf)
    """Ratios of the arm's velocity and acceleration to the motion's [-]."""
    course: Course | None = None
    """What its last part may go on from while it runs; None if it cannot."""
    surplus: tuple[float, float] = (0.0, 0.0)
    """`Filter.surplus` of the filter that it was planned for [-]."""


class MovePlanner:
    """Plans the motions of one robot."""

    def __init__(self, setup: Setup, filters: FilterPlanner) -> None:
        self._description, self._filters = setup.description, filters
        payload = body(setup.payload)
        self._collisions = CollisionModel(setup.description, payload)
        self.fitter = Fitter(setup)
        """Keeps motions within the limits of the joints."""

    def move(self, command: MoveJ, now: Snapshot, *, at_once: bool = False) -> PlannedMove:
        """Plan a motion from rest; the command's content has been checked.

        `at_once` leaves no time to shape the motion ahead.

        Raises:
            RefusalError: There is no such motion, or it would lead to a collision.
        """
        path = JointLine(now.q, np.array(command.q, dtype=float))
        limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
        if command.duration is None:
            planned = self.along(path, limits, now, at_once=at_once)
            slower = None if now.excess > 0.0 else slower_joint_motion(planned.parts[0], limits)
        else:
            limits = self._lasting(path, command.duration, now)
            agility = at_least(limits, AGILE.acceleration, AGILE.jerk)
            planned = self.along(path, limits, now, agility, at_once=at_once)
            slower = longer_joint_motion(planned.parts[0], command.duration)
        if slower is None or (planned.limited is not None and planned.limited[0] == "limit_torque"):
            return planned
        return planned._replace(limited=slower)

    def _lasting(self, path: JointLine, duration: float, now: Snapshot) -> MotionLimits:
        """Limits with which a motion takes a duration [s], or those of the arm if it takes longer with these."""
        limits = arm_limits(self._description)
        spared = replace(limits, acceleration=limits.acceleration * (1.0 - now.excess))
        slower = min(quickest_motion(path, spared, PERIOD).duration / duration, 1.0)
        if slower == 0.0:
            return limits
        return MotionLimits(
            limits.velocity * slower, limits.acceleration * slower**2, limits.jerk * slower**3
        )

    def along(
        self,
        path: Path,
        limits: MotionLimits,
        now: Snapshot,
        agility: MotionLimits | None = None,  # of pauses and changes of the speed; None: the motion's own
        *,
        at_once: bool = False,
    ) -> PlannedMove:
        """Plan a motion along a path, from where the reference is at rest to rest; for `at_once` see `move`.

        Raises:
            RefusalError: There is no such motion, or it would lead to a collision.
        """
        rate = rate_of(now.speed, limits.velocity, now.slowest)

        def make(slower: Slower) -> PlannedMotion:
            kept = replace(
                limits,
                velocity=limits.velocity * slower.velocity,
                acceleration=limits.acceleration * slower.acceleration,
            )
            spared = replace(kept, acceleration=kept.acceleration * (1.0 - now.excess))
            if isinstance(path, JointLine) and now.excess > 0.0 and not at_once:
                return keeping_motion(path, kept, self._filters.like(now.filter), rate, agility)
            return quickest_motion(path, spared, PERIOD, rate, agility)

        try:
            fitted = self.fitter.fit(
                make,
                now,
                None if at_once else lambda: self._filters.like(now.filter),
                limits if agility is None else None,
            )
        except ValueError as error:
            raise RefusalError("out_of_range", "velocity", str(error)) from error
        motion, slower = fitted.motion, fitted.slower
        found = self.meeting(path.whole, now)
        if found is not None:
            share, meeting = found
            time = motion.time_at(share)
            raise RefusalError("collision", "q", f"{meeting} {time:.2f} s after the start", CLEARANCE)
        velocity, arms = limits.velocity * slower.velocity, arm_limits(self._description)
        return PlannedMove(
            (motion,),
            velocity,
            fitted.limited,
            room=(arms.velocity / velocity, arms.acceleration / (limits.acceleration * slower.acceleration)),
            surplus=now.surplus,
        )

    def meeting(self, way: Way, now: Snapshot) -> tuple[float, Meeting] | None:
        """Return the share of a way after which two bodies would meet, and which; None if it is clear."""
        if self._collisions.declared is not now.body:
            self._collisions.declare(now.body)
        return self._collisions.on_way(way)
