"""Trigonometric basis functions of the joint angles, for polynomial estimators.

With u = q - centre of the selected joints, these are 1, and cos(m·u), sin(m·u) for integer m ≠ 0 with Σ |m_k| <=
degree; of m and -m, only the one whose first non-zero entry is positive. They are periodic in every joint, as the arm
is. They are ordered by degree; coefficients rely on this fixed order.
"""

from collections.abc import Iterator, Sequence
from math import comb

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError

MAX_JOINTS = 7
MAX_TERMS = 1000
"""Largest number of terms; more would take too long in a tick, and ring-downs could not identify them."""


class BasisFunctions:
    """A set of basis functions of selected joints."""

    def __init__(self, joints: Sequence[int], degree: int, centre: npt.ArrayLike | None = None) -> None:
        """Create the basis for up to 7 different joints; raise EstimatorError if an argument is invalid."""
        n = len(joints)
        if not 1 <= n <= MAX_JOINTS or len(set(joints)) != n or not set(joints) <= set(range(MAX_JOINTS)):
            raise EstimatorError("joints", joints, f"1 to {MAX_JOINTS} different indices below {MAX_JOINTS}")
        if degree not in range(MAX_TERMS):
            raise EstimatorError("degree", degree, "a whole number of at least 0")
        self.joints = tuple(int(j) for j in joints)  # indices of the selected joints, from 0
        self.degree = int(degree)  # highest total degree
        if len(self) > MAX_TERMS:
            raise EstimatorError("degree", degree, f"lower: {len(self)} terms, but {MAX_TERMS} are the most")
        self.centre: Floats = np.zeros(n) if centre is None else np.array(centre, dtype=float)
        """Angles that are subtracted [rad], shape (len(joints),), read-only."""
        if self.centre.shape != (n,) or not np.isfinite(self.centre).all():
            raise EstimatorError("centre", centre, f"{n} finite angles")
        self.centre.setflags(write=False)

    def __len__(self) -> int:
        n, degree = len(self.joints), self.degree
        return sum(2**i * comb(n, i) * comb(degree, i) for i in range(n + 1))

    def multiples(self) -> npt.NDArray[np.int64]:
        """Return the combinations m ≠ 0, one per row, shape (rows, len(joints))."""
        n = len(self.joints)
        rows = [
            row
            for total in range(1, self.degree + 1)
            for row in _rows(n, total)
            if next(m for m in row if m) > 0
        ]
        return np.array(rows, dtype=np.int64).reshape(len(rows), n)


def _rows(n: int, total: int) -> Iterator[tuple[int, ...]]:
    """Yield the integer vectors of length n with Σ|m| = total."""
    if n == 1:
        yield (total,)
        if total:
            yield (-total,)
        return
    for size in range(total, -1, -1):
        for rest in _rows(n - 1, total - size):
            yield (size, *rest)
            if size:
                yield (-size, *rest)


def terms(
    q: npt.ArrayLike, *, joints: Sequence[int], degree: int, centre: npt.ArrayLike | None = None
) -> Floats:
    """Return the design matrix for fitting the coefficients of a `Polynomial` with these parameters [-].

    Its shape is (N, terms), in the order of the coefficients: 1, then cos and sin of each combination.

    Args:
        q: Configurations [rad], shape (N, n).
        joints: Selected joints; this and all further arguments are as in `Polynomial`.
        degree: Highest total degree.
        centre: Centre of the angles [rad], shape (len(joints),).

    Raises:
        EstimatorError: A parameter is invalid.
    """
    basis, angles = BasisFunctions(tuple(joints), degree, centre), np.asarray(q, dtype=float)
    if angles.ndim != 2 or angles.shape[1] <= max(basis.joints):
        raise EstimatorError("q", angles.shape, f"of shape (N, n), n > {max(basis.joints)}")
    phase = (angles[:, basis.joints] - basis.centre) @ basis.multiples().T
    pairs = np.stack((np.cos(phase), np.sin(phase)), axis=2).reshape(len(phase), -1)
    return np.hstack((np.ones((len(phase), 1)), pairs))
