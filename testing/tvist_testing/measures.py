"""What the tool and the joints of a robot did, from the rows of a history. Nothing here needs more than Python."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tvist_testing.history import Row

GRAVITY = 9.81
"""Acceleration of free fall that the simulated sensor feels [m/s²]."""
TAIL = 0.2
"""Time at the end of the observed rest whose mean position is the attained position [s]."""
AFTER_STOP = 0.01
"""Time after the stop in which the end of the deceleration still counts as motion [s]."""


@dataclass(frozen=True)
class Settling:
    """How the tool settled after its reference had come to rest."""

    seconds: float
    """Time from the stop until the tool stays within the band [s]; infinite if it did not while it was observed."""
    farthest: float
    """Largest distance from the attained position after the stop [m]."""


def settling(rows: Sequence[Row], band: float) -> Settling:
    """Measure the settling of the flange of the flexible arm around the position that it attains.

    Args:
        rows: Ticks at rest, from the stop of the reference on, for longer than `TAIL`.
        band: Largest distance from the attained position [m].
    """
    stop, end = rows[0].time, rows[-1].time
    tail = [row.pose for row in rows if row.time > end - TAIL]
    attained = [math.fsum(pose[axis] for pose in tail) / len(tail) for axis in range(3)]
    distances = [math.dist(row.pose[:3], attained) for row in rows]
    outside = [row.time for row, distance in zip(rows, distances, strict=True) if distance > band]
    last = outside[-1] if outside else stop
    settled = last <= end - TAIL
    return Settling(last - stop if settled else math.inf, max(distances))


def vibration(rows: Sequence[Row], until: float) -> list[tuple[float, float]]:
    """Return the residual vibration: time after the stop [s] and |α| [m/s²] of each tick, from 10 ms after the stop on.

    α = f - Rᵀ (0, 0, g), the specific force at the flange without the reaction to gravity.

    Args:
        rows: Ticks at rest, from the stop of the reference on.
        until: Last time after the stop [s].
    """
    stop, slack = rows[0].time, 1e-9
    return [
        (row.time - stop, math.dist(row.acceleration, _reaction(row.pose[3:6])))
        for row in rows
        if AFTER_STOP + slack < row.time - stop <= until + slack
    ]


def _reaction(rotation: Sequence[float]) -> tuple[float, float, float]:
    """Reaction to gravity in a frame that is turned by a rotation vector [rad]: Rᵀ (0, 0, g), by Rodrigues' formula."""
    x, y, z = rotation
    angle = math.hypot(x, y, z)
    if angle == 0.0:
        return 0.0, 0.0, GRAVITY
    x, y, z = x / angle, y / angle, z / angle
    sine, share = math.sin(angle), 1.0 - math.cos(angle)
    return (
        GRAVITY * (share * x * z - sine * y),
        GRAVITY * (share * y * z + sine * x),
        GRAVITY * (1.0 - share * (x * x + y * y)),
    )


@dataclass(frozen=True)
class Extreme:
    """The largest absolute value of a quantity, in a joint or of the tool."""

    value: float
    time: float
    """Simulation time at which it occurred [s]."""


def largest(rows: Sequence[Row], quantity: str, joint: int) -> Extreme:
    """Return the largest absolute value of a joint's quantity, an attribute of `Row`."""
    row = max(rows, key=lambda one: abs(getattr(one, quantity)[joint]))
    return Extreme(abs(getattr(row, quantity)[joint]), row.time)


def fastest_tool(rows: Sequence[Row]) -> Extreme:
    """Return the largest speed of the tool centre point [m/s]."""
    row = max(rows, key=lambda one: math.hypot(*one.tool_speed[:3]))
    return Extreme(math.hypot(*row.tool_speed[:3]), row.time)
