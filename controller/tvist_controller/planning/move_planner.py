"""Planning of point-to-point motions, with checks for collisions and torque."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tvist_controller.collision import CLEARANCE, CollisionModel, Meeting
from tvist_controller.control.differentiator import Floats
from tvist_controller.control.inverse_dynamics import InverseDynamics
from tvist_controller.planning.basis import FilterBasis, MotionBasis
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.keeping import keeping_motion, shaped_ahead
from tvist_controller.quiet.elastic_arm import ElasticArm
from tvist_controller.quiet.quiet_motion import quiet_motion
from tvist_controller.refusal import RefusalError
from tvist_controller.safety import arm_limits, largest_torque, rate_of, torque_along
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import (
    JointLine,
    MotionLimits,
    Path,
    PlannedMotion,
    at_least,
    quickest_motion,
)
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_shaping.named import PLANNED

LOOKS = 64
"""Number of moments of a motion at which the torque is checked before the motion is simulated."""
AGILE = MotionLimits(1.5, 2.0, 100.0)
"""Limits of pauses and changes of the speed for motions that are slower by themselves: those of `move_j` by default."""
BLUNTED = 1.05
"""Largest ratio of the shaped motion's torque to that of the unshaped motion, behind which it lags [-]."""


@dataclass(frozen=True)
class PlannedMove:
    """A motion that may begin."""

    parts: tuple[PlannedMotion, ...]
    """Trajectories of its reference, each from rest to rest, in their order."""
    velocity: float
    """Largest velocity of any joint [rad/s]."""
    excess_of_torque: str | None
    """By how much the motion will exceed a torque limit, in words; None if it will not."""
    skipped: tuple[str, ...] = ()
    """A sentence for each blend that is left out."""
    window: float = math.inf
    """Longest delay of a shaper with which the limits hold at full rate [s]."""
    marks: tuple[tuple[int, float], ...] = ()
    """For each segment of a path, the part of the motion and the length on it where the blend at the segment's end
    begins, or where the segment ends without one [m]."""
    peak: float = math.inf
    """Largest `Filter.peak` with which they do [-]."""


class MovePlanner:
    """Plans the motions of one robot.

    Args:
        setup: Initial setup.
        filters: Creates its filters.
    """

    def __init__(self, setup: Setup, filters: FilterPlanner) -> None:
        self._description, self._filters = setup.description, filters
        payload = body(setup.payload)
        self._collisions = CollisionModel(setup.description, payload)
        self._dynamics = InverseDynamics(setup.description, payload)
        self._torque = np.array(setup.description.limits.torque)

    def move(self, command: MoveJ, basis: MotionBasis, *, at_once: bool = False) -> PlannedMove:
        """Plan a motion from rest; the command's content has been checked.

        Args:
            command: The command.
            basis: State that the motion depends on.
            at_once: Whether the plan must be made within a tick, which is too short for a quiet motion.

        Raises:
            RefusalError: There is no such motion, or it would lead to a collision.
        """
        path = JointLine(basis.q, np.array(command.q, dtype=float))
        limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
        if command.duration is None:
            arm = None if at_once else self._arm(basis.filter)
            return self.along(path, limits, basis, arm=arm, at_once=at_once)
        limits = self._lasting(path, command.duration, basis)
        agility = at_least(limits, AGILE.acceleration, AGILE.jerk)
        return self.along(path, limits, basis, agility, at_once=at_once)

    def _lasting(self, path: JointLine, duration: float, basis: MotionBasis) -> MotionLimits:
        """Limits with which a motion takes a duration [s], or those of the arm if it takes longer with these."""
        limits = arm_limits(self._description)
        spared = replace(limits, acceleration=limits.acceleration * (1.0 - basis.excess))
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
        basis: MotionBasis,
        agility: MotionLimits | None = None,
        arm: ElasticArm | None = None,
        *,
        at_once: bool = False,
    ) -> PlannedMove:
        """Plan a motion along a path, from rest to rest.

        Args:
            path: Path of the motion; it begins where the reference is at rest.
            limits: Limits for every joint.
            basis: State that the motion depends on.
            agility: Limits of pauses and changes of the speed; None for those of the motion.
            arm: Model of the arm, which a motion along a straight line in joint space is to leave without vibration;
                None for the quickest motion.
            at_once: Whether the plan must be made within a tick, which is too short to shape the motion ahead.

        Raises:
            RefusalError: There is no such motion, or it would lead to a collision.
        """
        spared = replace(limits, acceleration=limits.acceleration * (1.0 - basis.excess))
        rate = rate_of(basis.speed, limits.velocity, basis.slowest)
        try:
            if arm is not None and isinstance(path, JointLine):
                motion = quiet_motion(path, spared, arm, PERIOD, rate, agility)
            elif isinstance(path, JointLine) and basis.excess > 0.0 and not at_once:
                motion = keeping_motion(path, limits, self._filters.present(basis.filter), rate, agility)
            else:
                motion = quickest_motion(path, spared, PERIOD, rate, agility)
        except ValueError as error:
            raise RefusalError("out_of_range", "velocity", str(error)) from error
        found = self.meeting(motion, basis)
        if found is not None:
            share, meeting = found
            time = motion.time_at(share)
            raise RefusalError("collision", "q", f"{meeting} {time:.2f} s after the start", CLEARANCE)
        return PlannedMove((motion,), limits.velocity, self.excess_of_torque(motion, basis))

    def _arm(self, basis: FilterBasis) -> ElasticArm | None:
        """Model of the arm if the filter wants quiet motions; None if it does not, or if there is no model."""
        calibration = basis.source.calibration
        if basis.name != PLANNED or calibration is None or calibration.modal is None:
            return None
        return ElasticArm(self._description, calibration, basis.declared)

    def meeting(self, motion: PlannedMotion, basis: MotionBasis) -> tuple[float, Meeting] | None:
        """Return the share of a motion's way after which two bodies would meet, and which; None if it is clear."""
        if self._collisions.carried is not basis.carried:
            self._collisions.carry(basis.carried)
        return self._collisions.on_way(motion.path.whole)

    def excess_of_torque(self, motion: PlannedMotion, basis: MotionBasis) -> str | None:
        """Say by how much a motion will exceed a torque limit; None if it will not."""
        dynamics, allowed, limits = self._dynamics, self._torque, motion.limits
        dynamics.believe(basis.bodies)
        bound = largest_torque(dynamics, motion.path, limits.velocity, limits.acceleration)
        if (bound <= allowed).all() or (BLUNTED * self._before_shaping(motion) <= allowed).all():
            return None
        ahead = shaped_ahead(motion, self._filters.present(basis.filter))
        if ahead is None:
            return None
        most = torque_along(dynamics, ahead, PERIOD)
        joint = int(np.argmax(most / allowed))
        name, limit = self._description.robot.joints[joint], allowed[joint]
        if most[joint] <= limit:
            return None
        return (
            f"torque of joint {name} will reach {most[joint]:.0f} N m, {most[joint] - limit:.1f} beyond its "
            f"limit of {limit:g}: ask for less acceleration"
        )

    def _before_shaping(self, motion: PlannedMotion) -> Floats:
        """Largest torques that the motion would need without a filter, shape (n,) [N m]."""
        most: Floats = np.max([self._dynamics.effort(*state) for state in motion.states(LOOKS)], axis=0)
        return most
