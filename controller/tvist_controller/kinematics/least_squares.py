"""Joint positions at a pose by damped least squares, from a start nearby or anywhere."""

import math

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.kinematics.denavit_hartenberg import Floats, kinematics_into

ACCURACY = 1e-9
"""Error [m] and [rad] that a solution may have."""

AIM = 1e-12
"""Error [m] and [rad] above which a solution is improved."""

NO_TOOL_ROTATION = np.eye(3)
NO_TOOL_POSITION = np.zeros(3)


@compiled
def pose_error(
    rotation: Floats, position: Floats, now: Floats, place: Floats, error: Floats
) -> tuple[float, float]:
    """Compute the way from one pose (`now`, `place`) to another (`rotation`, `position`).

    Args:
        rotation: Rotation to reach, shape (3, 3).
        position: Position to reach, shape (3,) [m].
        now: Present rotation, shape (3, 3).
        place: Present position, shape (3,) [m].
        error: Result, shape (6,): translation [m] and rotation vector [rad] in the base frame.

    Returns:
        Length of the translation [m], and angle of the rotation [rad].
    """
    for i in range(3):
        error[i] = position[i] - place[i]
    # The rotation from now, in base axes, is rotation nowᵀ; of it only its trace and its skew part are needed.
    x, y, z, cosine = 0.0, 0.0, 0.0, -0.5
    for k in range(3):
        x += 0.5 * (now[1, k] * rotation[2, k] - now[2, k] * rotation[1, k])
        y += 0.5 * (now[2, k] * rotation[0, k] - now[0, k] * rotation[2, k])
        z += 0.5 * (now[0, k] * rotation[1, k] - now[1, k] * rotation[0, k])
        cosine += 0.5 * (now[0, k] * rotation[0, k] + now[1, k] * rotation[1, k] + now[2, k] * rotation[2, k])
    sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, cosine)
    scale = angle / sine if sine > 1e-12 else 1.0
    error[3], error[4], error[5] = scale * x, scale * y, scale * z
    return math.sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2]), angle


@compiled
def solve_in_place(A: Floats, b: Floats) -> None:
    """Solve A x = b for a symmetric positive definite A by Cholesky's method; b becomes x, and A is used up."""
    n = len(b)
    for j in range(n):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = math.sqrt(max(A[j, j], 1e-300))
        for i in range(j + 1, n):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
        for k in range(j):
            b[j] -= A[j, k] * b[k]
        b[j] /= A[j, j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= A[k, j] * b[k]
        b[j] /= A[j, j]


@compiled
def _linearize(
    dh: Floats, rotation: Floats, position: Floats, q: Floats, J: Floats, error: Floats
) -> tuple[float, float]:
    """Compute Jacobian and error at a posture; return the errors of position [m] and rotation [rad]."""
    now, place = np.empty((3, 3)), np.empty(3)
    kinematics_into(dh, NO_TOOL_ROTATION, NO_TOOL_POSITION, q, now, place, J)
    return pose_error(rotation, position, now, place, error)


@compiled
def _normal_matrix(J: Floats, added: float, A: Floats) -> None:
    """Compute the lower half of JᵀJ + added 1."""
    n = J.shape[1]
    for i in range(n):
        for j in range(i + 1):
            A[i, j] = 0.0
            for k in range(6):
                A[i, j] += J[k, i] * J[k, j]
        A[i, i] += added


@compiled
def descend(
    dh: Floats, rotation: Floats, position: Floats, near: Floats, pull: float, iterations: int, q: Floats
) -> float:
    """Minimize |error of the pose|² + pull |q - near|² from a start, by the method of Levenberg and Marquardt.

    The damping is proportional to the squared error, with which convergence is quadratic also to a solution at which
    the Jacobian is singular because the solution is one of many (Yamashita and Fukushima, 2001).

    Args:
        dh: Table whose first columns are those of `dh_table`, shape (n, 4), (n, 5), or (n, 17) with placements.
        rotation: Rotation to reach, shape (3, 3).
        position: Position to reach, shape (3,) [m].
        near: Joint positions to stay near to, shape (n,) [rad].
        pull: Weight of the distance from them [-]; 0 for any solution.
        iterations: Largest number of steps.
        q: Start, which becomes the result, shape (n,) [rad].

    Returns:
        Root of the summed squares of the errors of position [m] and rotation [rad].
    """
    n = dh.shape[0]
    J, error = np.empty((6, n)), np.empty(6)
    trial, step, A = np.empty(n), np.empty(n), np.empty((n, n))
    far, angle = _linearize(dh, rotation, position, q, J, error)
    square = far * far + angle * angle
    cost = square + pull * np.sum((q - near) ** 2)
    damping = 1.0
    for _ in range(iterations):
        if damping > 1e12 or (pull == 0.0 and square < 1e-30):
            break
        _normal_matrix(J, pull + damping * square + 1e-15, A)
        for i in range(n):
            step[i] = pull * (near[i] - q[i])
            for k in range(6):
                step[i] += J[k, i] * error[k]
        solve_in_place(A, step)
        trial[:] = q + step
        far, angle = _linearize(dh, rotation, position, trial, J, error)
        trial_square = far * far + angle * angle
        trial_cost = trial_square + pull * np.sum((trial - near) ** 2)
        if trial_cost < cost:
            stalled = trial_cost > cost * (1.0 - 1e-9)
            q[:] = trial
            square, cost = trial_square, trial_cost
            damping = max(0.1 * damping, 1e-6)
            if stalled:
                break
        else:
            if np.max(np.abs(step)) < 1e-13:
                break
            damping *= 10.0
            _linearize(dh, rotation, position, q, J, error)
    return math.sqrt(square)


@compiled
def approach(dh: Floats, rotation: Floats, position: Floats, near: Floats, q: Floats) -> float:
    """Move along the postures that have a pose, from one of them, to the nearest to `near`; return the error."""
    pull = 1e-2
    for _ in range(4):
        descend(dh, rotation, position, near, pull, 60, q)
        pull *= 1e-2
    return descend(dh, rotation, position, near, 0.0, 30, q)
