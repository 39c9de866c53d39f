import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_controller.kinematics.elimination import eliminate


@pytest.mark.parametrize("solve", [eliminate, eliminate.py_func], ids=["compiled", "python"])
@given(st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_it_solves_as_lapack_does(solve, n, seed):
    random = np.random.default_rng(seed)
    A, x = random.normal(size=(n, n)), random.normal(size=n)
    b = A @ x
    found = b.copy()
    solve(A.copy(), found)
    exact = np.linalg.solve(A, b)
    assert np.abs(found - exact).max() <= 1e-12 * np.linalg.cond(A) * max(1.0, np.abs(exact).max())


def test_it_exchanges_rows():
    x = np.array([2.0, 3.0])
    eliminate(np.array([[0.0, 1.0], [1.0, 0.0]]), x)
    assert x.tolist() == [3.0, 2.0]
