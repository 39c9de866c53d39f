"""The workspace in which an arm is measured and tested."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription


@dataclass(frozen=True)
class Region:
    """A box in joint space; joints without bounds stay at zero."""

    low: tuple[float, ...]  # lower bounds, one per joint from the base on [rad]
    high: tuple[float, ...]  # upper bounds, one per joint from the base on [rad]

    def spread(self, count: int, joints: int, seed: int) -> Floats:
        """Return configurations that cover the box evenly (scrambled Halton sequence), shape (count, joints) [rad]."""
        sampler = qmc.Halton(len(self.low), rng=np.random.default_rng(seed))
        return self._place(sampler.random(count), joints)

    def random(self, count: int, joints: int, seed: int) -> Floats:
        """Return independent configurations, shape (count, joints) [rad]."""
        return self._place(np.random.default_rng(seed).random((count, len(self.low))), joints)

    def _place(self, unit: Floats, joints: int) -> Floats:
        low, high = np.array(self.low), np.array(self.high)
        used = min(len(low), joints)
        q = np.zeros((len(unit), joints))
        q[:, :used] = (low + unit * (high - low))[:, :used]
        return q


WORKSPACE = Region(
    low=(-np.pi, -np.pi, -5.0 * np.pi / 6.0, -np.pi), high=(np.pi, 0.0, 5.0 * np.pi / 6.0, 0.0)
)
"""Workspace of a six-joint arm: above the stand, the wrist's two outer joints at zero."""


def ranges(description: RobotDescription) -> list[tuple[float, float]]:
    """Return the smallest and the largest angle of each joint of an arm [rad]."""
    return [(-limit, limit) for limit in description.limits.position]


def workspace(position: Sequence[tuple[float, float]], margin: float = 0.0) -> Region:
    """Return the workspace of an arm with these joint ranges [rad], at a margin from them [rad].

    An arm with fewer joints than `WORKSPACE` may stand and reach differently: its workspace is all that its
    limits allow, at most half a turn either way.
    """
    sides = len(WORKSPACE.low)
    whole = WORKSPACE if len(position) >= sides else Region(low=(-np.pi,) * sides, high=(np.pi,) * sides)
    limits = list(position)[:sides]
    low = [max(side, limit + margin) for side, (limit, _) in zip(whole.low, limits, strict=False)]
    high = [min(side, limit - margin) for side, (_, limit) in zip(whole.high, limits, strict=False)]
    return Region(low=tuple(low), high=tuple(high))


def identified(position: Sequence[tuple[float, float]], margin: float = 0.0) -> Region:
    """Return the workspace without the base: turning an arm on a rigid stand changes none of its modes."""
    region = workspace(position, margin)
    return Region(low=(0.0, *region.low[1:]), high=(0.0, *region.high[1:]))
