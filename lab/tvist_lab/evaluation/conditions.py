"""Conditions of an evaluation: limits of the moves, and what the controller does not know about the arm."""

from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from tvist_controller.api import InverseDynamics, MotionLimits, body, central_differences, paper_payload
from tvist_lab.evaluation.line import PAPER, point_to_point
from tvist_lab.evaluation.moves import Move
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

LIMITS = {"gentle": PAPER, "industrial": MotionLimits(velocity=3.0, acceleration=8.0, jerk=2000.0)}
"""Limits of moves by name: the paper's, and those of quick handling."""


@dataclass(frozen=True)
class Conditions:
    """Conditions under which moves are made."""

    limits: MotionLimits = PAPER
    """Limits of every joint."""
    payload_error: float = 0.0
    """Error of the declared mass, relative to the carried one [-]."""
    stiffness_error: float = 0.0
    """Relative deviation of each spring of the arm from what the controller knows, with random sign [-]."""

    def declared(self, move: Move) -> Move:
        """Return a move as the controller knows it."""
        return Move(move.start, move.target, move.mass * (1.0 + self.payload_error))

    def arm(self, description: RobotDescription, seed: int) -> RobotDescription:
        """Return the arm that makes a move: gears, links and velocity loops stiffer or softer at random."""
        if self.stiffness_error == 0.0:
            return description
        return softer_and_stiffer(description, self.stiffness_error, np.random.default_rng([seed, 29]))


AS_KNOWN = Conditions()
"""The paper's limits, and an arm that is as the controller knows it."""


def softer_and_stiffer(
    description: RobotDescription, share: float, random: np.random.Generator
) -> RobotDescription:
    """Return an arm with each gear, link and gain of the drives' loops changed by a share, up or down at random."""

    def scattered(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple((np.array(values) * random.choice([1.0 - share, 1.0 + share], len(values))).tolist())

    drives, links = description.drives, description.link_flexibility
    names = ("gear_stiffness", "velocity_gain", "position_gain")
    other = replace(drives, **{name: scattered(getattr(drives, name)) for name in names})
    bending = replace(links, stiffness=scattered(links.stiffness))
    return replace(description, drives=other, link_flexibility=bending)


def torque_share(description: RobotDescription, move: Move, limits: MotionLimits) -> float:
    """Return the largest torque that a rigid arm needs for a move, relative to its drive's limit [-]."""
    start, target = np.array(move.start), np.array(move.target)
    dynamics = InverseDynamics(description, body(paper_payload(description, move.mass)))
    q, qd, qdd = central_differences(point_to_point(start, target, limits), PERIOD)
    torque = dynamics.torques(q, qd, qdd) + np.array(description.drives.rotor_inertia) * qdd
    return float((np.abs(torque).max(axis=0) / np.array(description.limits.torque)).max())
