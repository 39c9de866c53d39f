"""Modes from the mass matrix: the linearised equations of the arm, solved at every configuration.

Each of the L coordinates is a joint, whose gear k is in series with a motor under P control of position and velocity,
or the bending of a link, which is a spring with a damper:

    F(s) v = [M(q) s² + diag κ(s)] v = 0,     κ(s) = k z/(k + z) at a joint,  z(s) = B s² + K_d (s + K_p)
                                              κ(s) = k           at a bend,   k(s) = K + D s

A pole s = -σ ± iω is a mode with f_d = ω/2π and ζ = σ/|s|. Poles change little within a tick, so Newton's method for
the nonlinear eigenvalue problem (Ruhe 1973) starts from the last ones. Each mode is thus followed by continuity, even
if two modes cross.
"""

from collections.abc import Callable

import numpy as np

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError, check_positive
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.poles import Complex, follow

JUMP = 0.1  # change of a joint between two estimates that is too large for a motion [rad]
RESTING, MOVING, JUMPED = range(3)  # relation of a configuration to the previous one


@compiled
def compare(q: Floats, last: Floats) -> int:
    """Compare a configuration with `last`, then store it in `last`; return RESTING, MOVING or JUMPED."""
    how = RESTING
    for joint in range(q.shape[0]):
        change = abs(q[joint] - last[joint])
        if not change < JUMP:
            how = JUMPED
        elif change > 0.0 and how == RESTING:
            how = MOVING
        last[joint] = q[joint]
    return how


@compiled
def describe(poles: Complex, f_d_min: float, zeta_max: float, f_d: Floats, zeta: Floats) -> bool:
    """Compute f_d [Hz] and ζ [-] of poles, clamped to their bounds; return whether one was clamped."""
    clipped = False
    for k in range(poles.shape[0]):
        f_d[k] = poles[k].imag / (2.0 * np.pi)
        zeta[k] = max(-poles[k].real / abs(poles[k]), 0.0)
        if f_d[k] < f_d_min or zeta[k] > zeta_max:
            clipped = True
            f_d[k], zeta[k] = max(f_d[k], f_d_min), min(zeta[k], zeta_max)
    return clipped


class Modal(Estimator):
    """The lowest modes of an arm with a known mass matrix, followed by continuity.

    A mode that was among the lowest may move above one that was not. `settle` therefore selects the lowest modes anew
    from all poles; `estimate` does so only if q jumps by more than any motion. If a pole is lost, because it no longer
    vibrates or coincides with another, `estimate` keeps all modes unchanged until it finds every one again.

    Attributes:
        drivetrain: Springs and motors.
        clipped: Whether a mode of the last estimate was clamped to `f_d_min` or `zeta_max`, or was lost.
    """

    abrupt = True

    def __init__(
        self,
        mass_matrix: Callable[[Floats], Floats],
        drivetrain: Drivetrain,
        *,
        modes: int = 3,
        f_d_min: float = 2.0,
        zeta_max: float = 0.9,
    ) -> None:
        """Create an estimator for one arm with one payload.

        Args:
            mass_matrix: Function from joint angles, shape (joints,) [rad], to M(q), symmetric, shape (L, L) [kg m^2];
                it may return the same array each time.
            drivetrain: Springs and motors of the L coordinates.
            modes: Number of lowest modes to estimate, 1 to L.
            f_d_min: Lower bound of the damped frequency [Hz], > 0; it determines the longest delay of a filter.
            zeta_max: Upper bound of the damping ratio [-], 0 to 1.

        Raises:
            EstimatorError: A value is out of range.
        """
        size = len(drivetrain.stiffness)
        if not 1 <= modes <= size:
            raise EstimatorError("modes", modes, f"1 to {size}, the number of coordinates")
        check_positive(EstimatorError, "Hz", f_d_min=f_d_min)
        if not 0.0 < zeta_max < 1.0:
            raise EstimatorError("zeta_max", zeta_max, "between 0 and 1")
        self.drivetrain = drivetrain
        self.clipped = False
        self._mass_matrix = mass_matrix
        self.modes, self.f_d_min, self.zeta_max = modes, f_d_min, zeta_max
        self._rows = drivetrain.rows
        self._poles: Complex = np.zeros(modes, dtype=complex)
        self._shapes: Complex = np.zeros((modes, size), dtype=complex)
        self._before = self._poles.copy(), self._shapes.copy()
        self._scratch: Complex = np.zeros((size, size + 1), dtype=complex)
        self._q: Floats = np.zeros(0)
        self._lowest, self._lost = False, False

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes at a configuration, each as the continuation of the last estimate's.

        Raises:
            EstimatorError: q or the mass matrix has the wrong shape, or the arm has fewer vibrating modes at q.
        """
        self._go_to(q)
        return self._describe()

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the lowest modes at a configuration, regardless of the last estimate; see `estimate`."""
        if self._compare_with_last(q) != RESTING or not self._lowest:
            self._take_lowest(q, self._mass_matrix(q))
        return self._describe()

    def poles(self, q: Floats) -> Complex:
        """Poles at a configuration [1/s], shape (modes,); as in `estimate`, but not clamped."""
        self._go_to(q)
        return self._poles.copy()

    def _describe(self) -> tuple[Floats, Floats]:
        f_d, zeta = np.empty(self.modes), np.empty(self.modes)
        beyond = describe(self._poles, self.f_d_min, self.zeta_max, f_d, zeta)
        self.clipped = beyond or self._lost
        return f_d, zeta

    def _compare_with_last(self, q: Floats) -> int:
        """Compare a configuration with the last one, then store it as last; the first counts as a jump."""
        if q.shape != self._q.shape:
            if q.ndim != 1:
                raise EstimatorError("q", q.shape, "of shape (joints,)")
            size, shape = len(self._rows[0]), np.shape(self._mass_matrix(q))
            if shape != (size, size):
                raise EstimatorError(
                    "mass_matrix(q)", shape, f"of shape {(size, size)}, as the drivetrain is"
                )
            self._q = np.full(q.shape, np.inf)
        return compare(q, self._q)

    def _go_to(self, q: Floats) -> None:
        how = self._compare_with_last(q)
        if how == RESTING and not self._lost:
            return
        mass = self._mass_matrix(q)
        if how == JUMPED:
            self._take_lowest(q, mass)
            return
        self._lowest = False
        self._before[0][:], self._before[1][:] = self._poles, self._shapes
        self._lost = not follow(mass, self._rows, self._poles, self._shapes, self._scratch)
        if self._lost:
            self._poles[:], self._shapes[:] = self._before
            self._check(q, mass)

    def _take_lowest(self, q: Floats, mass: Floats) -> None:
        self._check(q, mass)
        poles, shapes = self.drivetrain.poles(mass)
        if len(poles) < self.modes:
            self._q = np.zeros(0)
            raise EstimatorError(
                "modes",
                self.modes,
                f"at most {len(poles)}, the number of modes that vibrate at {q.tolist()}",
            )
        self._poles[:], self._shapes[:] = poles[: self.modes], shapes[: self.modes]
        self._lowest, self._lost = True, False

    def _check(self, q: Floats, mass: Floats) -> None:
        if not np.isfinite(mass).all():
            self._q = np.zeros(0)
            raise EstimatorError("mass_matrix(q)", mass.tolist(), f"finite, at q = {q.tolist()}")
