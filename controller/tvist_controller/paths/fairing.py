"""Blends that meet on short lines: between points so close that next to nothing of a line is left between two blends.

Curvature that rises from 0 and falls back to 0 at each of these points would be what slows the arm down. So the blends
on both sides of such a line are drawn out to meet on it, with one curvature for both, and the tool leaves the line by
at most `OFF`.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.paths.legs import Leg
from tvist_controller.paths.tool_curves import PER_RADIAN, ToolLine
from tvist_controller.trajectory.limits import Floats

OFF = 1e-5
"""Largest distance from a line where two blends meet on it, outside their radii [m]."""
SHALLOW = 0.3
"""Largest turn of the tool's way at a corner next to such a line [rad]."""
STEEPER = 1.5
"""Largest ratio of the curvature where two blends meet to the smaller one of both [-]."""


class Meeting(NamedTuple):
    """Place of a leg at which the blends before and behind it meet."""

    s: float
    """Length from the leg's start [m]."""
    bend: Floats
    """Second derivatives of the tool's position and turn there, shape (6,) [1/m, rad/m^2]."""


def meetings(legs: Sequence[Leg]) -> list[Meeting | None]:
    """Return for each leg where the blends before and behind it meet, if they do."""
    corners = [_corner(*pair) for pair in pairwise(legs)]
    found: list[Meeting | None] = [None] * len(legs)
    for number in range(1, len(legs) - 1):
        before, behind = corners[number - 1], corners[number]
        if before is not None and behind is not None:
            found[number] = _meeting(legs[number], legs[number - 1].blend, before, behind)
    return found


def _corner(leg: Leg, then: Leg) -> Floats | None:
    """Mean curvature of the way around a corner, shape (6,); None if it is no shallow one between two lines."""
    if not (isinstance(leg.way, ToolLine) and isinstance(then.way, ToolLine) and leg.blend > 0.0):
        return None
    change = then.way.first - leg.way.first
    if _size(change) > SHALLOW:
        return None
    bend: Floats = 2.0 * change / (leg.way.length + then.way.length)
    return bend


def _meeting(leg: Leg, blend: float, before: Floats, behind: Floats) -> Meeting | None:
    assert isinstance(leg.way, ToolLine)
    way = leg.way
    start, end = way.within(blend), way.length - way.within(leg.blend)
    gap = end - start
    if not 0.0 <= gap < np.inf or max(_size(before), _size(behind)) * gap**2 > 8.0 * OFF:
        return None
    bend = np.concatenate([_between(before[part], behind[part]) for part in (slice(3), slice(3, 6))])
    along = way.first[:3]
    speed = float(along @ along)
    if speed > 0.0:  # the way is curved there, and not hurried
        bend[:3] -= (bend[:3] @ along / speed) * along
    return Meeting(0.5 * (start + end), bend)


def _between(one: Floats, other: Floats) -> Floats:
    """Curvature between two: their mean, or less if it would exceed the smaller one by far; 0 if they turn apart."""
    if one @ other <= 0.0:
        return np.zeros_like(one)
    mean = 0.5 * (one + other)
    most = STEEPER * min(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    found: Floats = mean * min(most / float(np.linalg.norm(mean)), 1.0)
    return found


def _size(change: Floats) -> float:
    return max(float(np.linalg.norm(change[:3])), PER_RADIAN * float(np.linalg.norm(change[3:])))
