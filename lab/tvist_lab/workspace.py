"""The workspace in which an arm is measured and tested."""

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
        return self._place(qmc.Halton(len(self.low), rng=np.random.default_rng(seed)).random(count), joints)

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
)  # workspace of a six-joint arm: above the stand, the wrist's two outer joints at zero


def workspace(description: RobotDescription, margin: float = 0.0) -> Region:
    """Return the workspace of an arm, at a margin from the limits of its joints [rad].

    An arm with fewer joints than `WORKSPACE` may be mounted in another way, so its workspace is the whole
    range of its joints, at most half a turn either way.
    """
    limits, sides = description.limits.position, len(WORKSPACE.low)
    whole = WORKSPACE if len(limits) >= sides else Region(low=(-np.pi,) * sides, high=(np.pi,) * sides)
    low = [max(side, margin - limit) for side, limit in zip(whole.low, limits, strict=False)]
    high = [min(side, limit - margin) for side, limit in zip(whole.high, limits, strict=False)]
    return Region(low=tuple(low), high=tuple(high))


def identified(description: RobotDescription, margin: float = 0.0) -> Region:
    """Return the workspace without the base: turning an arm on a rigid stand changes none of its modes."""
    region = workspace(description, margin)
    return Region(low=(0.0, *region.low[1:]), high=(0.0, *region.high[1:]))
