"""Modes from the mass matrix: the arm's equations, linearised, solved anew at every configuration.

Each of the L coordinates is a joint, whose gear k stands in series with a motor under P control of position and
velocity, or the bending of a link, a spring with its damper alone:

    F(s) v = [M(q) s² + diag κ(s)] v = 0,     κ(s) = k z/(k + z) at a joint,  z(s) = B s² + K_d (s + K_p)
                                              κ(s) = k           at a bend,   k(s) = K + D s

A pole s = -σ ± iω is a mode with f_d = ω/2π and ζ = σ/|s|. Poles move little in a tick: Newton's method for the
nonlinear eigenvalue problem goes on from the last ones, so each mode is followed by continuity, also where two
cross. (Motor impedance in series with the gear is the textbook model of a flexible joint under drive control; Newton's
method for eigenvalues that enter nonlinearly: Ruhe 1973.)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvist_shaping._compiled import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator

Complex = npt.NDArray[np.complex128]

STEPS = 12
"""Newton steps for a mode; two or three do from one tick to the next."""
TURNED = 0.01
"""Square of the change of a shape, of largest entry 1, above which a step is not the last [-]."""
CONVERGED = 1e-5
"""Newton step of a pole against its size that is the last: what is left is that squared [-]."""
APART = 1e-7
"""Distance against their size below which two poles followed are suspected of being one [-]."""
LOWEST = 0.5
"""Frequency below which a pole is no vibration [Hz]."""
DAMPED = 0.9
"""Damping ratio above which a pole is no vibration [-]."""
JUMP = 0.1
"""Change of a joint from one estimate to the next that no motion makes [rad]."""
RESTING, MOVING, JUMPED = range(3)
"""How a configuration lies to the last."""


@dataclass(frozen=True)
class Drivetrain:
    """Springs and motors, one entry a coordinate of the mass matrix.

    Raises:
        EstimatorError: A value is not positive and finite, or lengths differ.
    """

    stiffness: tuple[float, ...]
    """K of gears and bends [N m/rad]."""
    rotor_inertia: tuple[float, ...]
    """B of the motor behind it; 0 at a bend, which has none [kg m^2]."""
    velocity_gain: tuple[float, ...]
    """K_d [N m s/rad]; not used at a bend."""
    position_gain: tuple[float, ...]
    """K_p [1/s]; not used at a bend."""
    damping: tuple[float, ...] = ()
    """D of gears and bends [N m s/rad]; empty: none."""

    def __post_init__(self) -> None:
        size = len(self.stiffness)
        if not self.damping:
            object.__setattr__(self, "damping", (0.0,) * size)
        for name in ("stiffness", "rotor_inertia", "velocity_gain", "position_gain", "damping"):
            values = np.array(getattr(self, name), dtype=float)
            if values.shape != (size,) or size == 0:
                raise EstimatorError(name, values.tolist(), f"a list of {size} numbers, at least one")
            positive = values > 0.0 if name == "stiffness" else values >= 0.0
            if not (np.isfinite(values) & positive).all():
                raise EstimatorError(name, values.tolist(), "positive and finite")
        if not any(self.rotor_inertia):
            raise EstimatorError("rotor_inertia", self.rotor_inertia, "positive at one coordinate at least")

    @property
    def rows(self) -> Floats:
        """The five, shape (5, L)."""
        return np.array(
            [self.stiffness, self.rotor_inertia, self.velocity_gain, self.position_gain, self.damping]
        )

    def system(self, mass: Floats) -> tuple[Floats, Floats, Floats]:
        """Inertia, damping and stiffness of the L coordinates and, behind them, of the n motors that drive some.

        Args:
            mass: M(q), shape (L, L) [kg m^2].

        Returns:
            Three matrices of shape (L+n, L+n).
        """
        K, B, K_d, K_p, D = self.rows
        driven = np.flatnonzero(B)
        L, n = len(K), len(driven)
        stiffness, damping, inertia = np.zeros((3, L + n, L + n))
        coordinates, motors = np.arange(L), L + np.arange(n)
        inertia[:L, :L], inertia[motors, motors] = mass, B[driven]
        for matrix, spring in ((stiffness, K), (damping, D)):
            matrix[coordinates, coordinates] = spring
            matrix[motors, motors] = spring[driven]
            matrix[driven, motors] = matrix[motors, driven] = -spring[driven]
        stiffness[motors, motors] += K_d[driven] * K_p[driven]
        damping[motors, motors] += K_d[driven]
        return inertia, damping, stiffness

    def poles(self, mass: Floats) -> tuple[Complex, Complex]:
        """All poles that vibrate, by eigenvalues of the whole linear system.

        Args:
            mass: M(q), shape (L, L) [kg m^2].

        Returns:
            Poles in the order of their frequency, shape (k,) [1/s], and their shapes, (k, L), of largest entry 1.
        """
        inertia, damping, stiffness = self.system(mass)
        L, N = len(self.stiffness), len(inertia)
        system = np.zeros((2 * N, 2 * N))
        system[:N, N:] = np.eye(N)
        system[N:, :N], system[N:, N:] = (-np.linalg.solve(inertia, part) for part in (stiffness, damping))
        values, vectors = np.linalg.eig(system)
        vibrates = (values.imag > 2.0 * np.pi * LOWEST) & (-values.real < DAMPED * np.abs(values))
        chosen = np.flatnonzero(vibrates)
        chosen = chosen[np.argsort(values[chosen].imag)]
        shapes = vectors[:L, chosen].T
        largest = np.abs(shapes).argmax(axis=1)
        return values[chosen], shapes / shapes[np.arange(len(chosen)), largest][:, None]


@compiled
def follow(mass: Floats, rows: Floats, poles: Complex, shapes: Complex, scratch: Complex) -> bool:
    """Newton's method for every pole, from where it was; poles and shapes are changed in place.

    Args:
        mass: M, shape (L, L).
        rows: `Drivetrain.rows`.
        poles: Shape (k,).
        shapes: Shape (k, L), largest entry 1.
        scratch: Shape (L + k, L + 1).

    Returns:
        Whether all converged, to poles of their own; where not, all are left as they were.
    """
    L = mass.shape[0]
    before = scratch[L:]
    before[:, 0] = poles
    before[:, 1:] = shapes
    if _converge(mass, rows, poles, shapes, scratch[:L]):
        return True
    poles[:] = before[:, 0]
    shapes[:] = before[:, 1:]
    return False


@compiled
def _converge(  # noqa: C901, PLR0912 - one kernel: its branches are loops over coordinates
    mass: Floats, rows: Floats, poles: Complex, shapes: Complex, matrix: Complex
) -> bool:
    """Do the same as `follow`; if it fails, poles and shapes are not usable."""
    L = mass.shape[0]
    for k in range(poles.shape[0]):
        s = poles[k]
        found = False
        for _ in range(STEPS):
            # F is symmetric, so the pole that belongs to a shape v solves vᵀ F(s) v = 0: the error of v enters
            # squared.
            for _ in range(STEPS):
                residual, slope = 0.0j, 0.0j
                for i in range(L):
                    along = 0.0j
                    for j in range(L):
                        along += mass[i, j] * shapes[k, j]
                    spring, change = _spring(rows, i, s)
                    v = shapes[k, i]
                    residual += v * (along * s * s + spring * v)
                    slope += v * (2.0 * along * s + change * v)
                if slope == 0.0:
                    return False
                step = residual / slope
                s -= step
                if not abs(step) > CONVERGED * abs(s):
                    break
            if not abs(s) < 1e9:
                return False
            # The shape that belongs to the pole, by inverse iteration: F(s) x = F'(s) v.
            for i in range(L):
                right = 0.0j
                for j in range(L):
                    entry = mass[i, j] * s
                    matrix[i, j] = entry * s
                    right += entry * shapes[k, j]
                spring, change = _spring(rows, i, s)
                matrix[i, i] += spring
                matrix[i, L] = 2.0 * right + change * shapes[k, i]
            if not _solve(matrix):
                found = True  # s is the pole to the last bit
                break
            largest = 0
            for i in range(1, L):
                if abs(matrix[i, L]) > abs(matrix[largest, L]):
                    largest = i
            scale = matrix[largest, L]
            # Newton's next step of the pole itself.
            step = shapes[k, largest] / scale
            s -= step
            turn = 1.0 / scale
            turned = 0.0
            for i in range(L):
                v = matrix[i, L] * turn
                turned += abs(v - shapes[k, i]) ** 2
                shapes[k, i] = v
            # The step says nothing where the shape is another one than it was: two modes that are almost one.
            if abs(step) <= CONVERGED * abs(s) and turned <= TURNED:
                found = True
                break
        if not found or s.imag <= 2.0 * np.pi * LOWEST or -s.real >= DAMPED * abs(s):
            return False
        poles[k] = s
    for k in range(poles.shape[0]):
        for m in range(k):
            if abs(poles[k] - poles[m]) < APART * abs(poles[k]):
                # One pole twice has one shape; two that cross have two.
                along = 0.0j
                first, second = 0.0, 0.0
                for i in range(L):
                    along += shapes[k, i] * np.conj(shapes[m, i])
                    first += abs(shapes[k, i]) ** 2
                    second += abs(shapes[m, i]) ** 2
                if abs(along) ** 2 > (1.0 - 1e-6) * first * second:
                    return False
    return True


@compiled
def _spring(rows: Floats, i: int, s: complex) -> tuple[complex, complex]:
    """κ(s) of a coordinate, and its derivative."""
    D = rows[4, i]
    k = rows[0, i] + D * s
    if rows[1, i] == 0.0:
        return k, D + 0.0j
    z = rows[1, i] * s * s + rows[2, i] * (s + rows[3, i])
    of_gear, of_motor = k / (k + z), z / (k + z)
    return k * of_motor, of_gear * of_gear * (2.0 * rows[1, i] * s + rows[2, i]) + of_motor * of_motor * D


@compiled
def _solve(matrix: Complex) -> bool:  # noqa: C901 - likewise
    """Gaussian elimination with pivots; the solution takes the place of the last column."""
    L = matrix.shape[0]
    for i in range(L):
        pivot = i
        for j in range(i + 1, L):
            if abs(matrix[j, i]) > abs(matrix[pivot, i]):
                pivot = j
        if matrix[pivot, i] == 0.0:
            return False
        if pivot != i:
            for c in range(i, L + 1):
                matrix[i, c], matrix[pivot, c] = matrix[pivot, c], matrix[i, c]
        turn = 1.0 / matrix[i, i]
        for j in range(i + 1, L):
            factor = matrix[j, i] * turn
            for c in range(i + 1, L + 1):
                matrix[j, c] -= factor * matrix[i, c]
    for i in range(L - 1, -1, -1):
        value = matrix[i, L]
        for c in range(i + 1, L):
            value -= matrix[i, c] * matrix[c, L]
        matrix[i, L] = value / matrix[i, i]
    return True


@compiled
def compare(q: Floats, last: Floats) -> int:
    """How a configuration lies to the last one, which it replaces."""
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
    """Frequencies and damping ratios of poles, held where they are believed; whether one had to be."""
    clipped = False
    for k in range(poles.shape[0]):
        f_d[k] = poles[k].imag / (2.0 * np.pi)
        zeta[k] = max(-poles[k].real / abs(poles[k]), 0.0)
        if f_d[k] < f_d_min or zeta[k] > zeta_max:
            clipped = True
            f_d[k], zeta[k] = max(f_d[k], f_d_min), min(zeta[k], zeta_max)
    return clipped


class Modal(Estimator):
    """Lowest modes of an arm whose mass matrix is known at every configuration, followed by continuity.

    A mode that was among the lowest may end above one that was not. So `settle` takes the lowest anew, from all
    poles. `estimate` does so only where q jumps as no motion does. Where a pole is lost, because it vibrates no longer
    or meets another, `estimate` leaves all modes as they were until every one is found again.

    Attributes:
        drivetrain: Springs and motors.
        clipped: Whether a mode of the last estimate was beyond `f_d_min` or `zeta_max`, and held there; or one was
            lost.
    """

    drivetrain: Drivetrain

    def __init__(
        self,
        mass_matrix: Callable[[Floats], Floats],
        drivetrain: Drivetrain,
        *,
        modes: int = 3,
        f_d_min: float = 2.0,
        zeta_max: float = 0.9,
    ) -> None:
        """An estimator for one arm with one payload.

        Args:
            mass_matrix: M(q) for joint angles of shape (joints,) [rad], symmetric, shape (L, L) [kg m^2]; a new
                array or always the same one.
            drivetrain: Springs and motors of the L coordinates.
            modes: Number of modes to estimate, the lowest, 1 to L.
            f_d_min: Lowest damped frequency that is believed [Hz], > 0: says how long a filter can get.
            zeta_max: Highest damping ratio that is believed [-], 0 to 1.

        Raises:
            EstimatorError: A value is out of range.
        """
        size = len(drivetrain.stiffness)
        if not 1 <= modes <= size:
            raise EstimatorError("modes", modes, f"1 to {size}, the number of coordinates")
        if not 0.0 < f_d_min < np.inf:
            raise EstimatorError("f_d_min", f_d_min, "a finite number of Hz above 0")
        if not 0.0 < zeta_max < 1.0:
            raise EstimatorError("zeta_max", zeta_max, "between 0 and 1")
        self.drivetrain = drivetrain
        self.clipped = False
        self._mass_matrix = mass_matrix
        self._modes, self._f_d_min, self._zeta_max = modes, f_d_min, zeta_max
        self._rows = drivetrain.rows
        self._poles: Complex = np.zeros(modes, dtype=complex)
        self._shapes: Complex = np.zeros((modes, size), dtype=complex)
        self._scratch: Complex = np.zeros((size + modes, size + 1), dtype=complex)
        self._q: Floats = np.zeros(0)
        self._lowest, self._lost = False, False

    def __repr__(self) -> str:
        return f"Modal(modes={self._modes}, f_d_min={self._f_d_min:g}, zeta_max={self._zeta_max:g})"

    @property
    def modes(self) -> int:
        """Number of modes."""
        return self._modes

    @property
    def f_d_min(self) -> float:
        """Lowest damped frequency that is believed [Hz]."""
        return self._f_d_min

    @property
    def zeta_max(self) -> float:
        """Highest damping ratio that is believed [-]."""
        return self._zeta_max

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Modes at a configuration, each the continuation of the last estimate's.

        Args:
            q: Joint angles [rad], shape (joints,).

        Returns:
            f_d [Hz] and ζ [-], each of shape (modes,), held inside `f_d_min` and `zeta_max`.

        Raises:
            EstimatorError: q or the mass matrix does not fit, or the arm has fewer modes that vibrate at q.
        """
        self._go_to(q)
        return self._describe()

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """The lowest modes at a configuration, whatever the last estimate was.

        Args:
            q: Joint angles, see `estimate`.

        Returns:
            As of `estimate`.

        Raises:
            EstimatorError: See `estimate`.
        """
        if self._lie(q) != RESTING or not self._lowest:
            self._take_lowest(q, self._mass_matrix(q))
        return self._describe()

    def poles(self, q: Floats) -> Complex:
        """Poles at a configuration [1/s], shape (modes,); as `estimate`, not held inside any range."""
        self._go_to(q)
        return self._poles.copy()

    def _part(self) -> None:
        self._poles, self._shapes = self._poles.copy(), self._shapes.copy()
        self._scratch, self._q = np.empty_like(self._scratch), self._q.copy()

    def _describe(self) -> tuple[Floats, Floats]:
        f_d, zeta = np.empty(self._modes), np.empty(self._modes)
        beyond = describe(self._poles, self._f_d_min, self._zeta_max, f_d, zeta)
        self.clipped = beyond or self._lost
        return f_d, zeta

    def _lie(self, q: Floats) -> int:
        if q.shape != self._q.shape:
            self._begin(q)
        return compare(q, self._q)

    def _go_to(self, q: Floats) -> None:
        how = self._lie(q)
        if how == RESTING and not self._lost:
            return
        mass = self._mass_matrix(q)
        if how == JUMPED:
            self._take_lowest(q, mass)
            return
        self._lowest = False
        self._lost = not follow(mass, self._rows, self._poles, self._shapes, self._scratch)
        if self._lost:
            self._check(q, mass)

    def _take_lowest(self, q: Floats, mass: Floats) -> None:
        self._check(q, mass)
        poles, shapes = self.drivetrain.poles(mass)
        if len(poles) < self._modes:
            self._q = np.zeros(0)
            raise EstimatorError(
                "modes",
                self._modes,
                f"at most {len(poles)}, the number of modes that vibrate at {q.tolist()}",
            )
        self._poles[:], self._shapes[:] = poles[: self._modes], shapes[: self._modes]
        self._lowest, self._lost = True, False

    def _check(self, q: Floats, mass: Floats) -> None:
        if not np.isfinite(mass).all():
            self._q = np.zeros(0)
            raise EstimatorError("mass_matrix(q)", mass.tolist(), f"finite, at q = {q.tolist()}")

    def _begin(self, q: Floats) -> None:
        """Check once what stays as it is, and know no last configuration."""
        if q.ndim != 1:
            raise EstimatorError("q", q.shape, "of shape (joints,)")
        size = len(self.drivetrain.stiffness)
        shape = np.shape(self._mass_matrix(q))
        if shape != (size, size):
            raise EstimatorError("mass_matrix(q)", shape, f"of shape {(size, size)}, as the drivetrain is")
        self._q = np.full(q.shape, np.inf)
