import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tvist_shaping import EstimatorError, Polynomial, terms
from tvist_shaping.estimators.polynomial import MARGIN, saturate

WIDE = {"f_d_range": (1e-3, 1e3), "zeta_range": (0.0, 0.99)}
configurations = st.lists(st.floats(-6.3, 6.3), min_size=6, max_size=6)


def polynomial(degree=2, joints=(1, 2, 3), seed=0, **changes):
    """Random coefficients around 100 Hz and 0.5, well inside wide ranges."""
    random = np.random.default_rng(seed)
    n = terms(np.zeros((1, 7)), joints=joints, degree=degree).size
    parameters = {
        "joints": joints,
        "degree": degree,
        "f_d_coefficients": np.append(500.0, random.uniform(-50.0, 50.0, n - 1) / n),
        "zeta_coefficients": np.append(0.5, random.uniform(-0.2, 0.2, n - 1) / n),
        **WIDE,
    }
    return Polynomial(**(parameters | changes)), parameters


def test_terms_are_all_combinations_up_to_the_degree_once():
    q = np.random.default_rng(1).normal(size=(9, 3))
    a, b = q[:, 0], q[:, 2]
    phases = [a, b, 2 * a, a + b, a - b, 2 * b]
    direct = [np.ones(9), *(f(p) for p in phases for f in (np.cos, np.sin))]
    made = terms(q, joints=(0, 2), degree=2)
    np.testing.assert_allclose(made, np.stack(direct, axis=1), atol=1e-14)


@given(configurations, st.integers(0, 4))
def test_kernel_equals_the_design_matrix_times_the_coefficients(q, degree):
    estimator, p = polynomial(degree, centre=[0.1, -0.2, 0.3])
    row = terms([q], joints=p["joints"], degree=degree, centre=[0.1, -0.2, 0.3])[0]
    f_d, zeta = row @ p["f_d_coefficients"], row @ p["zeta_coefficients"]
    if 150.0 < f_d < 850.0 and 0.1 < zeta < 0.89:
        made = estimator.estimate(np.array(q))
        assert made[0][0] == pytest.approx(f_d, rel=1e-11)
        assert made[1][0] == pytest.approx(zeta, rel=1e-11)


def wave(**changes):
    """f_d = 10.5 + 20 sin(q) in [Hz], ζ = 0.3, held in 6 to 15 Hz."""
    parameters = {"f_d_range": (6.0, 15.0), "zeta_range": (0.05, 0.5)} | changes
    return Polynomial(
        joints=[0], degree=1, f_d_coefficients=[10.5, 0, 20], zeta_coefficients=[0.3, 0, 0], **parameters
    )


@given(st.floats(-1e6, 1e6))
def test_estimate_is_clamped_to_its_range(q):
    estimator = wave()
    f_d, _ = estimator.estimate(np.array([q]))
    assert estimator.f_d_min == 6.0 <= f_d[0] <= 15.0
    assert estimator.zeta_max == 0.5


@given(st.floats(6.0, 15.0))
def test_estimate_well_inside_the_range_is_unchanged(f_d):
    bent = 9.0 * MARGIN
    found = wave().estimate(np.array([math.asin((f_d - 10.5) / 20.0)]))[0][0]
    inside = min(f_d - 6.0, 15.0 - f_d) - bent
    assume(not -0.05 < inside < 0.0)  # it begins to bend too little to be seen
    assert (found == pytest.approx(f_d, rel=1e-12)) == (inside >= 0.0)


def test_saturation_has_two_continuous_derivatives():
    x = np.linspace(4.0, 17.0, 130001)
    step = x[1] - x[0]
    y = np.array([saturate(value, 6.0, 15.0) for value in x])
    slope = np.diff(y) / step
    curvature = np.diff(slope) / step
    width = 9.0 * MARGIN
    assert np.abs(np.diff(slope)).max() < 2.0 * step / width
    assert np.abs(np.diff(curvature)).max() < 10.0 * step / width**2 + 1e-6
    assert slope.min() >= -1e-9
    assert slope.max() <= 1.0 + 1e-9


def test_configuration_with_too_few_joints_is_refused():
    estimator, p = polynomial()
    with pytest.raises(EstimatorError, match="q is"):
        estimator.estimate(np.zeros(3))
    for q in (np.zeros((2, 3)), np.zeros(6)):
        with pytest.raises(EstimatorError, match="q is"):
            terms(q, joints=p["joints"], degree=2)
