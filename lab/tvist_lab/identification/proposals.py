"""Jogs that would tell most of springs and drives, with free ways to them from where the arm stands."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tvist_controller.api.line import (
    REBOUND,
    CollisionModel,
    InverseDynamics,
    JointLine,
    MotionLimits,
    acceleration_on_way,
    body,
)
from tvist_lab.identification.design import choose
from tvist_lab.identification.ring_downs import Jog
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats

SPARE = 3
"""Number of candidates that are ordered for each proposal, since the way to some is not free."""
STEP = 0.03
"""Angle of the fastest joint between two postures in which a way is checked [rad]."""
GENTLEST = 0.4
"""Smallest quickness of a jog over the one that is wanted [-]."""


@dataclass(frozen=True)
class Proposal:
    """A move that would tell much: a jog to a configuration, after free ways to its start."""

    way: tuple[Floats, ...]
    """Postures to go to one after the other, the last of which is the jog's start, each of shape (n,) [rad]."""
    q: Floats
    """End of the jog, where the arm rings, shape (n,) [rad]."""
    limits: MotionLimits


def propose(
    arm: ArmModes,
    candidates: Sequence[Floats],
    jog: Jog,
    at: tuple[Floats, int],
    count: int,
    known: tuple[Floats, Floats] | None = None,
) -> tuple[Proposal, ...]:
    """Choose the jogs that would tell most, the most informative first.

    Args:
        arm: The arm with its payloads.
        candidates: Configurations at whose end and start it is clear, each of shape (n,) [rad].
        jog: The move that excites it.
        at: Where it stands, shape (n,) [rad], and the index of its payload.
        count: Number of jogs; fewer are returned where the ways to others are not free.
        known: Logarithms of the parameters and their covariance; None for the guess.
    """
    here, payload = at
    counts = [SPARE * count if number == payload else 0 for number in range(len(arm.payloads))]
    order = choose(arm, candidates, jog, counts, known)
    collisions = CollisionModel(arm.description, body(arm.payloads[payload]))
    dynamics = InverseDynamics(arm.description, body(arm.payloads[payload]))
    joints, torque = arm.description.joints, np.array(arm.description.limits.torque)
    upright = here * np.array([joint not in (1, 2, 3) for joint in range(joints)])
    upright[[joint for joint in (1, 3) if joint < joints]] = -np.pi / 2
    found: list[Proposal] = []
    for number, _ in order:
        q = candidates[number]
        start = q - jog.of(joints)
        way = next((way for way in ((start,), (upright, start)) if is_free(collisions, here, *way, q)), None)
        quickness = _quickness(dynamics, start, q, jog.limits, torque)
        if way is not None and quickness >= GENTLEST and len(found) < count:
            found.append(Proposal(way, q, slower(jog.limits, quickness)))
            here = q
    return tuple(found)


def slower(limits: MotionLimits, quickness: float) -> MotionLimits:
    """Return the limits of a motion that takes longer by 1 / quickness."""
    return MotionLimits(
        quickness * limits.velocity, quickness**2 * limits.acceleration, quickness**3 * limits.jerk
    )


def _quickness(
    dynamics: InverseDynamics, start: Floats, end: Floats, limits: MotionLimits, torque: Floats
) -> float:
    """Return the largest share, up to 1, of a jog's quickness with which the arm rings within its torques.

    A drive at its limit would spoil the ring-down.
    """
    line = JointLine(start, end)
    room = acceleration_on_way(dynamics, line, start, end - start, limits.velocity, torque)
    return min(1.0, float(np.sqrt(room / (1.0 + REBOUND) / limits.acceleration)))


def is_free(collisions: CollisionModel, *postures: Floats) -> bool:
    """Return whether the straight ways from posture to posture, in the space of the joints, are clear."""
    for before, after in pairwise(postures):
        steps = max(int(np.ceil(np.max(np.abs(after - before)) / STEP)), 1)
        if any(
            collisions.meeting(before + (after - before) * k / steps) is not None for k in range(steps + 1)
        ):
            return False
    return True
