"""Follow poles between configurations by Newton's method for the nonlinear eigenvalue problem of `modal`."""

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats

Complex = npt.NDArray[np.complex128]

LOWEST = 0.5  # frequency below which a pole does not count as a vibration [Hz]
DAMPED = 0.9  # damping ratio above which a pole does not count as a vibration [-]
STEPS = 12  # largest number of Newton steps for a mode; two or three are enough between ticks
TURNED = 0.01  # squared change of a shape with largest entry 1 above which another step is needed [-]
CONVERGED = 1e-5
"""Largest relative last Newton step of a converged pole; the remaining error is its square [-]."""
APART = 1e-7  # relative distance below which two poles may be the same one [-]


@compiled
def follow(  # noqa: C901, PLR0912 - one kernel: its branches are loops over coordinates
    mass: Floats, rows: Floats, poles: Complex, shapes: Complex, matrix: Complex
) -> bool:
    """Update every pole in place by Newton's method; return whether all converged, to different poles.

    After a failure, poles and shapes are invalid. `rows` are `Drivetrain.rows`; `matrix` is scratch, shape (L, L + 1).
    """
    L = mass.shape[0]
    for k in range(poles.shape[0]):
        s = poles[k]
        found = False
        for _ in range(STEPS):
            # F is symmetric, so the s that solves vᵀ F(s) v = 0 has an error of second order in that of the shape v.
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
            # Compute the shape for this pole by inverse iteration: F(s) x = F'(s) v.
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
                found = True  # s is exactly the pole
                break
            largest = 0
            for i in range(1, L):
                if abs(matrix[i, L]) > abs(matrix[largest, L]):
                    largest = i
            scale = matrix[largest, L]
            # Newton's next step for the pole itself.
            step = shapes[k, largest] / scale
            s -= step
            turn = 1.0 / scale
            turned = 0.0
            for i in range(L):
                v = matrix[i, L] * turn
                turned += abs(v - shapes[k, i]) ** 2
                shapes[k, i] = v
            # If the shape has changed, a small step proves nothing, since two modes may be nearly equal.
            if abs(step) <= CONVERGED * abs(s) and turned <= TURNED:
                found = True
                break
        if not found or s.imag <= 2.0 * np.pi * LOWEST or -s.real >= DAMPED * abs(s):
            return False
        poles[k] = s
    for k in range(poles.shape[0]):
        for m in range(k):
            if abs(poles[k] - poles[m]) < APART * abs(poles[k]):
                # If two poles are nearly equal, equal shapes mean that one pole was found twice;
                # shapes of crossing poles differ.
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
    """Return κ(s) of a coordinate and its derivative."""
    D = rows[4, i]
    k = rows[0, i] + D * s
    if rows[1, i] == 0.0:
        return k, D + 0.0j
    z = rows[1, i] * s * s + rows[2, i] * (s + rows[3, i])
    of_gear, of_motor = k / (k + z), z / (k + z)
    return k * of_motor, of_gear * of_gear * (2.0 * rows[1, i] * s + rows[2, i]) + of_motor * of_motor * D


@compiled
def _solve(matrix: Complex) -> bool:  # noqa: C901 - likewise
    """Solve by Gaussian elimination with pivoting; the solution replaces the last column."""
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
