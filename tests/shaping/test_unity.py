import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import SHAPERS, Fixed, TvistFilter, residual, shaper, um_zv, um_zvd, zv, zvd

dampings = st.floats(0.0, 0.4999)


def test_the_damped_times_are_the_golden_ones(golden):
    for entry in golden["um_zv"]:
        zeta = entry["zeta"]
        in_undamped_periods = um_zv(1.0, zeta).tau / math.sqrt(1.0 - zeta**2)
        np.testing.assert_allclose(in_undamped_periods, entry["undamped_periods"], atol=6e-6)
    np.testing.assert_allclose(um_zvd(1.0, 0.0).tau, [0.0, 0.08951, 0.36623, 0.64296, 0.73247], atol=6e-6)


@given(dampings, st.floats(0.5, 50.0))
def test_nothing_is_left_and_with_a_derivative_nothing_near_either(zeta, f_d):
    one, two = um_zv(f_d, zeta), um_zvd(f_d, zeta)
    assert residual(f_d, zeta, one) < 1e-9
    assert residual(f_d, zeta, two) < 1e-9
    near = f_d * (1.0 + 1e-4 * np.array([-1.0, 1.0]))
    slope, none = (residual(near, zeta, train) / 1e-4 for train in (one, two))
    assert slope.min() > 0.5
    assert none.max() < 0.1


@given(dampings)
def test_every_impulse_is_of_one_size_and_comes_after_the_last(zeta):
    for train in (um_zv(1.0, zeta), um_zvd(1.0, zeta)):
        np.testing.assert_allclose(np.abs(train.A), 1.0, atol=1e-12)
        assert np.diff(train.tau).min() > 0.005


def test_they_are_shorter_than_positive_impulses_for_the_same_and_forgive_less():
    for unity, positive in ((um_zv, zv), (um_zvd, zvd)):
        for zeta in (0.0, 0.1, 0.3, 0.49):
            assert unity(1.0, zeta).duration < 0.8 * positive(1.0, zeta).duration
    assert SHAPERS["um_zv"].band() == pytest.approx((0.972, 1.027), abs=1e-3)
    assert SHAPERS["um_zvd"].band()[1] < SHAPERS["zvd"].band()[1]


@pytest.mark.parametrize("name", ["um_zv", "um_zvd", "zv", "ei3"])
def test_the_peak_in_the_catalogue_bounds_what_a_filter_makes_of_an_acceleration_and_is_reached(name):
    tvist = TvistFilter(shaper(name), Fixed([2.0], [0.0]), joints=1)
    # The acceleration turns round with the impulses: the worst there is.
    impulses = tvist.impulses
    t = 0.002 * np.arange(1500)
    end = 2.0 + impulses.duration
    acceleration = np.zeros(t.size)
    for A, tau in zip(impulses.A, impulses.tau, strict=True):
        late = np.clip((t - (end - tau)) / 0.02, -1.0, 1.0)
        acceleration += np.sign(A) * np.cos(0.5 * np.pi * late) ** 2
    reference = np.cumsum(np.cumsum(acceleration)) * 0.002**2
    shaped = np.array([tvist.filter([x])[0] for x in reference])
    peak = np.abs(np.diff(shaped, 2)).max() / 0.002**2
    assert peak <= SHAPERS[name].peak * 1.01
    assert peak >= SHAPERS[name].peak * 0.95


def test_positive_shapers_have_a_peak_of_one():
    for name, entry in SHAPERS.items():
        assert entry.peak == (1.0 if not name.startswith("um_") else {"um_zv": 3.0, "um_zvd": 5.0}[name])
