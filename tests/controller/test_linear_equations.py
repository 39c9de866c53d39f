import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_controller.kinematics.least_squares import solve_in_place


@pytest.mark.parametrize("solve", [solve_in_place, solve_in_place.py_func], ids=["compiled", "python"])
@given(st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_it_solves_as_lapack_does_and_knows_the_determinant(solve, n, seed):
    random = np.random.default_rng(seed)
    root, x = random.normal(size=(n, n)), random.normal(size=n)
    A = root @ root.T
    b = A @ x
    found = b.copy()
    half = solve(A.copy(), found)
    exact = np.linalg.solve(A, b)
    worst = 1e-12 * np.linalg.cond(A)
    assert np.abs(found - exact).max() <= worst * max(1.0, np.abs(exact).max())
    assert abs(half - abs(np.linalg.det(root))) <= worst * half


def test_a_singular_matrix_has_next_to_no_determinant():
    assert solve_in_place(np.zeros((3, 3)), np.zeros(3)) == pytest.approx(0.0, abs=1e-12)
    assert solve_in_place(np.ones((4, 4)), np.ones(4)) == pytest.approx(0.0, abs=1e-12)
