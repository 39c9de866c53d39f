"""Small systems of linear equations, for kernels.

numba's own linear algebra needs scipy, which a served robot does without.
"""

import numpy as np
from numpy.typing import NDArray

from tvist_controller._compiled import compiled


@compiled
def eliminate(A: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """Solve A x = b by elimination with pivots, A of shape (n, n), b of shape (n,); b becomes x, and A is used up.

    numba does not see changes of this function in the kernels that call it: after one, remove their `__pycache__`.
    """
    n = b.shape[0]
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, n):
                A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
            b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= factor * A[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
