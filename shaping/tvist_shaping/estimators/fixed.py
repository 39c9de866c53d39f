"""Modes that do not depend on the configuration, for classic time-invariant input shaping."""

from collections.abc import Sequence

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.impulse_train import F_D_RANGE


class Fixed(Estimator):
    """Estimator with the same modes at every configuration."""

    def __init__(self, f_d: Sequence[float], zeta: Sequence[float]) -> None:
        """Set the modes.

        Args:
            f_d: Damped frequencies [Hz], one for each mode, 1e-6 to 1e6.
            zeta: Damping ratios [-], one for each mode, 0 <= ζ < 1.

        Raises:
            EstimatorError: A value is out of range, or the lengths differ.
        """
        self._f_d: Floats = np.array(f_d, dtype=float)
        self._zeta: Floats = np.array(zeta, dtype=float)
        if self._f_d.ndim != 1 or self._f_d.size == 0:
            raise EstimatorError("f_d", f_d, "a list of at least one number")
        if self._zeta.shape != self._f_d.shape:
            raise EstimatorError("zeta", zeta, f"a list as long as f_d: {self._f_d.size}")
        if not ((self._f_d >= F_D_RANGE[0]) & (self._f_d <= F_D_RANGE[1])).all():
            raise EstimatorError("f_d", f_d, f"{F_D_RANGE[0]:g} to {F_D_RANGE[1]:g} Hz")
        if not ((self._zeta >= 0.0) & (self._zeta < 1.0)).all():
            raise EstimatorError("zeta", zeta, "at least 0 and less than 1")
        self._f_d.setflags(write=False)
        self._zeta.setflags(write=False)
        self.modes = self._f_d.size
        self.f_d_min, self.zeta_max = float(self._f_d.min()), float(self._zeta.max())

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:  # noqa: ARG002  the same at every q
        """Return the modes, f_d [Hz] and ζ [-], each of shape (modes,), read-only."""
        return self._f_d, self._zeta
