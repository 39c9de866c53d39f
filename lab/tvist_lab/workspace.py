"""Workspace in which a six-joint arm on a stand is measured and tested."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tvist_lab.recordings import Floats


@dataclass(frozen=True)
class Region:
    """A box in joint space; joints without bounds stay at zero."""

    low: tuple[float, ...]
    """Lower bounds, one per joint from the base on [rad]."""
    high: tuple[float, ...]
    """Upper bounds, one per joint from the base on [rad]."""

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
    low=(-np.pi, -np.pi, -5.0 * np.pi / 6.0, -np.pi),
    high=(np.pi, 0.0, 5.0 * np.pi / 6.0, 0.0),
)
"""Space above the stand, with the wrist's two outer joints at zero."""
IDENTIFIED = Region(low=(0.0, *WORKSPACE.low[1:]), high=(0.0, *WORKSPACE.high[1:]))
"""Workspace without the base joint, which does not change the modes of an arm on a rigid stand."""
