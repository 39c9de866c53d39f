"""Find the rotation between two sets of vectors."""

import numpy as np

from tvist_lab.recordings.recording import Floats


def rotation(products: Floats) -> Floats:
    """Return the R that minimizes Σ |a_i - R b_i|², shape (3, 3); `products` is Σ a_i b_iᵀ."""
    # Kabsch, Acta Crystallographica A32, 1976.
    left, _, right = np.linalg.svd(products)
    return np.asarray(left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right)
