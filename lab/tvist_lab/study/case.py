"""A case of a study: an arm, its task, and the errors of its controller's knowledge."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tvist_controller.api.line import InverseDynamics, MotionLimits, body, central_differences, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER, point_to_point
from tvist_lab.study.method import Method
from tvist_lab.study.moves import Move, stopped_stream
from tvist_plant.description import RobotDescription
from tvist_plant.variants import AS_DESCRIBED, Variant

LIMITS = {"gentle": PAPER, "industrial": MotionLimits(velocity=3.0, acceleration=8.0, jerk=2000.0)}
"""Limits of moves by name: the paper's, and those of quick handling."""


def arm_seed(seed: int, place: int) -> int:
    """Return the seed of gear errors for the move with an index; each move has another seed."""
    return (1_000_003 * seed + place) % 2**63


@dataclass(frozen=True)
class Case:
    """A move or a stream; it can be sent to another process."""

    description: RobotDescription  # the controller's model of the arm
    move: Move  # the move, with the carried mass
    seed: int = 0  # seed of gear errors, and of the arm's deviations
    arms: tuple[Variant, ...] = (AS_DESCRIBED,)
    limits: MotionLimits = PAPER  # limits of every joint
    payload_error: float = 0.0  # error of the declared mass, relative to the carried one [-]
    stream: bool = False
    """Whether, instead of the move, to follow a stream that begins at the move's start and is stopped."""
    methods: tuple[Method, ...] = ()  # methods for this case; empty for those of its study
    axes: Mapping[str, Any] = field(default_factory=dict)
    """Cells in the case's rows, by column name, that distinguish the case from others of the study."""

    @property
    def declared(self) -> Move:
        """The move with the declared mass, which the controller knows, instead of the carried one."""
        return Move(self.move.start, self.move.target, self.move.mass * (1.0 + self.payload_error))

    @property
    def torque_share(self) -> float:
        """Largest torque that a rigid arm needs for the move, relative to its drive's limit [-]."""
        description = self.description
        dynamics = InverseDynamics(description, body(paper_payload(description, self.move.mass)))
        q, qd, qdd = central_differences(self.point_to_point())
        torque = dynamics.torques(q, qd, qdd) + np.array(description.drives.rotor_inertia) * qdd
        return float((np.abs(torque).max(axis=0) / np.array(description.limits.torque)).max())

    def point_to_point(self) -> Floats:
        """Return the reference of the move, shape (T, n) [rad]."""
        return point_to_point(np.array(self.move.start), np.array(self.move.target), self.limits)

    def reference(self) -> Floats:
        """Return the reference to follow, of the move or the stream, shape (T, n) [rad]."""
        if not self.stream:
            return self.point_to_point()
        return stopped_stream(self.description, np.array(self.move.start), self.seed, self.limits)
