"""Joint positions at a pose by damped least squares."""

import math

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.kinematics.pose import locate, pose_error
from tvist_kernels.compiling import inlined
from tvist_plant.model import Floats

ACCURACY = 1e-9  # permitted error of a solution [m and rad]

AIM = 1e-12  # error above which a solution is refined [m and rad]

NO_PIVOT = 1e-30  # smallest pivot, to avoid overflow with a singular matrix


@compiled
def solve_in_place(A: Floats, b: Floats) -> float:
    """Solve A x = b in place for symmetric positive definite A (Cholesky); return √(det A).

    A is overwritten. Not numba's own solver, because that needs scipy, which a served robot does without.
    """
    n, root = len(b), 1.0
    for j in range(n):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = math.sqrt(max(A[j, j], NO_PIVOT))
        root *= A[j, j]
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
    return root


@compiled
def _linearize(
    chain: Floats, rotation: Floats, position: Floats, q: Floats, J: Floats, error: Floats
) -> tuple[float, float]:
    """Compute Jacobian and error at a posture; return the errors of position [m] and rotation [rad]."""
    now, place = np.empty((3, 3)), np.empty(3)
    locate(chain, q, now, place, J)
    return pose_error(rotation, position, now, place, error)


@inlined
def put(values: Floats, place: Floats) -> None:
    """Copy a vector in a loop; numba takes seconds to compile an assignment of arrays."""
    for i in range(len(values)):
        place[i] = values[i]


@inlined
def _normal_matrix(J: Floats, added: float, A: Floats) -> None:
    n = J.shape[1]
    for i in range(n):
        for j in range(i + 1):
            A[i, j] = 0.0
            for k in range(6):
                A[i, j] += J[k, i] * J[k, j]
        A[i, i] += added


@compiled
def _square_distance(a: Floats, b: Floats) -> float:
    square = 0.0
    for i in range(len(a)):
        square += (a[i] - b[i]) * (a[i] - b[i])
    return square


@compiled
def descend(
    chain: Floats,  # the links, see `tvist_plant.chain`, shape (n+1, 22)
    rotation: Floats,  # to reach, like the position
    position: Floats,
    near: Floats,
    pull: float,  # 0 for any solution [-]
    iterations: int,
    q: Floats,  # start, which becomes the result
) -> float:
    """Minimize |pose error|² + pull |q - near|² from a start (Levenberg-Marquardt); return the pose error.

    The damping is proportional to the squared error, so convergence is quadratic even if the Jacobian is
    singular because the solution is one of many (Yamashita and Fukushima, 2001). The result combines position
    [m] and rotation [rad].
    """
    n = q.shape[0]
    J, error = np.empty((6, n)), np.empty(6)
    trial, step, A = np.empty(n), np.empty(n), np.empty((n, n))
    far, angle = _linearize(chain, rotation, position, q, J, error)
    square = far * far + angle * angle
    cost = square + pull * _square_distance(q, near)
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
        most = 0.0
        for i in range(n):
            trial[i] = q[i] + step[i]
            most = max(most, abs(step[i]))
        far, angle = _linearize(chain, rotation, position, trial, J, error)
        trial_square = far * far + angle * angle
        trial_cost = trial_square + pull * _square_distance(trial, near)
        if trial_cost < cost:
            stalled = trial_cost > cost * (1.0 - 1e-9)
            put(trial, q)
            square, cost = trial_square, trial_cost
            damping = max(0.1 * damping, 1e-6)
            if stalled:
                break
        else:
            if most < 1e-13:
                break
            damping *= 10.0
            _linearize(chain, rotation, position, q, J, error)
    return math.sqrt(square)


@compiled
def approach(chain: Floats, rotation: Floats, position: Floats, near: Floats, q: Floats) -> float:
    """Move along postures with equal pose to the one nearest to `near`; return the error."""
    pull = 1e-2
    for _ in range(4):
        descend(chain, rotation, position, near, pull, 60, q)
        pull *= 1e-2
    return descend(chain, rotation, position, near, 0.0, 30, q)
