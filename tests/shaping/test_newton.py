import numpy as np
import pytest

from tvist_shaping import ConvergenceError
from tvist_shaping.newton import solve


def test_it_finds_a_root_to_rounding():
    root = solve(
        lambda x: np.stack([x[:, 0] ** 2 + x[:, 1] ** 2 - 1.0, x[:, 0] - x[:, 1]], axis=1),
        np.array([1.0, 0.2]),
    )
    np.testing.assert_allclose(root, [np.sqrt(0.5)] * 2, atol=1e-12)


@pytest.mark.parametrize(
    "equations",
    [
        lambda x: x**2 + 1.0,  # no root
        lambda x: 0.0 * x + 1.0,  # no slope
        lambda x: np.full_like(x, np.nan),
    ],
)
def test_where_there_is_none_it_says_so(equations):
    with pytest.raises(ConvergenceError, match="1 equations"):
        solve(equations, np.array([0.3]))
