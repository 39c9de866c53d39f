"""Planning of point-to-point motions, with checks for collisions and torque."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE, CloseBodies, CollisionModel
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import Fitter, SlowdownFactors, keeping_motion
from tvist_controller.planning.slower import Limited, longer_joint_motion, slower_joint_motion
from tvist_controller.planning.snapshot import ExtendableMotion, PlanningState
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import (
    CheckedMotion,
    JointLine,
    MotionLimits,
    PlannedMotion,
    at_least,
    quickest_motion,
)
from tvist_protocol.commands import MoveJ

AGILE = MotionLimits(1.5, 2.0, 100.0)
"""Limits of pauses and speed changes for slower motions: the defaults of `move_j`."""


class PlannedMove(NamedTuple):
    """A motion ready to start."""

    parts: tuple[PlannedMotion, ...]  # consecutive trajectories of the reference, each from rest to rest
    velocity: float  # largest velocity of any joint [rad/s]
    limited: Limited | None  # limit, with a message, that slows it down or that it will exceed; else None
    skipped: tuple[str, ...] = ()  # message for each omitted blend
    window: float = math.inf  # longest shaper delay at which the limits hold at full rate [s]
    marks: tuple[tuple[int, float], ...] = ()
    """For each segment of a path, the part and the length on it [m] where the blend at its end begins, or
    where it ends without one."""
    peak: float = math.inf  # largest `Filter.peak` at which the limits hold at full rate [-]
    room: tuple[float, float] = (math.inf, math.inf)
    """Ratios of the arm's velocity and acceleration limits to the motion's [-]."""
    extendable: ExtendableMotion | None = None
    """State from which its last part can be extended while it runs; None if it cannot."""
    excess_at_limits: tuple[float, float] = (0.0, 0.0)  # `Filter.excess_at_limits` of its filter [-]


class MovePlanner(Fitter):
    """Plans the motions of one robot."""

    def __init__(self, setup: Setup, filters: FilterPlanner) -> None:
        super().__init__(setup)
        self._filters = filters
        self._collisions = CollisionModel(setup.description, body(setup.payload))

    def move(self, command: MoveJ, now: PlanningState, *, at_once: bool = False) -> PlannedMove:
        """Plan a motion from rest or raise RefusalError; with `at_once`, save time: no shaping in advance."""
        path, duration = JointLine(now.q, np.array(command.q, dtype=float)), command.duration
        limits, agility = MotionLimits(command.velocity, command.acceleration, command.jerk), None
        if duration is not None:
            limits = self._lasting(path, duration, now)
            agility = at_least(limits, AGILE.acceleration, AGILE.jerk)
        rate = rate_of(now.speed, limits.velocity, now.slowest)

        def make(slower: SlowdownFactors) -> PlannedMotion:
            kept = replace(
                limits,
                velocity=limits.velocity * slower.velocity,
                acceleration=limits.acceleration * slower.acceleration,
            )
            if now.excess > 0.0 and not at_once:
                return keeping_motion(path, kept, self._filters.like(now.filter), rate, agility)
            reduced = replace(kept, acceleration=kept.acceleration * (1.0 - now.excess))
            return quickest_motion(path, reduced, rate, agility)

        tvist = None if at_once else lambda: self._filters.like(now.filter)
        try:
            motion, slower, limited, _ = self.fit(make, now, tvist, limits if agility is None else None)
        except ValueError as error:
            raise RefusalError("out_of_range", "velocity", str(error)) from error
        if (found := self.meeting(path.whole, now)) is not None:
            share, meeting = found
            time = motion.time_at(share)
            raise RefusalError("collision", "q", f"{meeting} {time:.2f} s after the start", CLEARANCE)
        if limited is None or limited[0] != "limit_torque":
            if duration is not None:
                limited = longer_joint_motion(motion, duration) or limited
            elif now.excess == 0.0:
                limited = slower_joint_motion(motion, limits) or limited
        velocity, arms = limits.velocity * slower.velocity, arm_limits(self._description)
        return PlannedMove(
            (motion,),
            velocity,
            limited,
            room=(arms.velocity / velocity, arms.acceleration / (limits.acceleration * slower.acceleration)),
            excess_at_limits=now.excess_at_limits,
        )

    def _lasting(self, path: JointLine, duration: float, now: PlanningState) -> MotionLimits:
        """Return limits with which a motion takes a duration [s], or the arm's if those make it longer."""
        limits = arm_limits(self._description)
        reduced = replace(limits, acceleration=limits.acceleration * (1.0 - now.excess))
        slower = min(quickest_motion(path, reduced).duration / duration, 1.0)
        if slower == 0.0:
            return limits
        return MotionLimits(
            limits.velocity * slower, limits.acceleration * slower**2, limits.jerk * slower**3
        )

    def meeting(self, way: CheckedMotion, now: PlanningState) -> tuple[float, CloseBodies] | None:
        """Return where bodies first come too close on a way (share of it), and the bodies; else None."""
        if self._collisions.declared is not now.body:
            self._collisions.declare(now.body)
        return self._collisions.on_way(way)
