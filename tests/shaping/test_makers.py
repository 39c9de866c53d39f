import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import (
    SHAPERS,
    DesignError,
    FilterError,
    Fixed,
    ImpulseError,
    ShaperRangeError,
    TvistFilter,
    band,
    custom,
    ei_of,
    mzv_of,
    product,
    residual,
    si_of,
    zv,
)


def by_pseudo_inverse(n, t):
    """The definition itself: n - 1 zeros at 1 + i/τ times the frequency, as an overdetermined linear system."""
    tau, times = t * (n - 2) / (n - 2 * t - 1), np.linspace(0.0, t, n)
    rows = [np.ones(n)]
    for i in range(n - 1):
        angles = 2 * np.pi * (1 + i / tau) * times
        rows += [np.cos(angles), np.sin(angles)]
    return np.linalg.pinv(np.array(rows)) @ np.eye(2 * n - 1)[0]


@pytest.mark.parametrize(
    ("n", "t"),
    [(3, 0.75), (3, 2 / 3), (3, 0.8), (3, 0.99), (4, 0.75), (4, 1.0), (5, 1.0), (5, 1.5), (8, 2.0)],
)
def test_a_modified_shaper_has_its_zeros_where_it_should(n, t):
    impulses = mzv_of(n, t).function(1.0, 0.0)
    np.testing.assert_allclose(impulses.A, by_pseudo_inverse(n, t), atol=1e-9)
    assert impulses.duration == pytest.approx(t)
    zeros = 1.0 + np.arange(n - 1) * (n - 2 * t - 1) / (t * (n - 2))
    assert residual(zeros, 0.0, impulses).max() < 1e-7
    assert residual(9.0, 0.2, mzv_of(n, t).function(9.0, 0.2)) < 1e-12


def test_known_ones_come_out():
    r = math.sqrt(0.5)
    np.testing.assert_allclose(mzv_of(3, 0.75).function(1, 0).A, [1 - r, 2 * r - 1, 1 - r], atol=1e-12)
    np.testing.assert_allclose(mzv_of(3, 2 / 3).function(1, 0).A, [1 / 3] * 3, atol=1e-12)
    np.testing.assert_allclose(mzv_of(3, 0.8).function(1, 0).A, [0.276393, 0.447214, 0.276393], atol=1e-6)
    assert mzv_of(3, 2 / 3).band() == pytest.approx((0.9596, 1.0425), abs=1e-4)
    assert mzv_of(3, 0.8).band() == pytest.approx((0.9440, 1.0701), abs=1e-4)
    for made, name in (
        (mzv_of(), "mzv"),
        (ei_of(), "ei"),
        (ei_of(2), "ei2"),
        (ei_of(3), "ei3"),
        (si_of(), "si"),
    ):
        for zeta in (0.0, 0.2):
            own, known = made.function(7.0, zeta), SHAPERS[name].function(7.0, zeta)
            np.testing.assert_allclose(own.A, known.A, atol=1e-14)
            np.testing.assert_allclose(own.tau, known.tau, atol=1e-15)


@given(st.floats(0.002, 0.4), st.floats(0.0, 0.9))
def test_a_height_of_ones_own_is_left_at_the_frequency_without_damping_and_less_with_it(V, zeta):
    made = ei_of(1, V)
    assert residual(9.0, 0.0, made.function(9.0, 0.0)) == pytest.approx(V, abs=1e-12)
    assert residual(9.0, zeta, made.function(9.0, zeta)) <= V + 1e-12
    low, high = made.band(V + 1e-9)
    assert residual(np.linspace(low, high, 500), 0.0, made.function(1.0, 0.0)).max() <= V + 1e-8


@pytest.mark.parametrize(
    ("n", "t"), [(2, 0.5), (3, 1.0), (3, 1.2), (4, 1.5), (3, 0.0), (3, -1.0), (3, math.nan)]
)
def test_too_few_impulses_for_their_duration_are_refused(n, t):
    with pytest.raises(DesignError, match=r"(n|t) is .*, but must be"):
        mzv_of(n, t)


def test_a_duration_that_makes_an_amplitude_negative_is_refused_with_what_to_do():
    with pytest.raises(DesignError, match=r"t is 0.4, but must be longer, for 3 impulses") as error:
        mzv_of(3, 0.4)
    assert error.value.field == "t"


def test_a_users_own_impulses_are_a_shaper_like_any_other():
    train = zv(8.0, 0.0)
    mine = custom("mine", train.A, train.tau, 8.0)
    assert (mine.name, mine.duration_periods, mine.peak) == ("mine", 0.5, 1.0)
    assert mine.band() == pytest.approx(SHAPERS["zv"].band())
    faster = mine.function(16.0, 0.3)
    np.testing.assert_array_equal(faster.A, train.A)
    np.testing.assert_allclose(faster.tau, train.tau / 2.0)
    tvist = TvistFilter(mine, Fixed([8.0, 20.0], [0.0, 0.1]), joints=1)
    np.testing.assert_allclose(tvist.impulses.tau, product([mine.function(f, 0.0) for f in (8.0, 20.0)]).tau)
    np.testing.assert_array_equal(tvist.filter([0.0]), [0.0])


def test_negative_impulses_say_by_how_much_they_exceed_the_limits():
    assert custom("mine", [1.0, -1.0, 1.0], [0.0, 1 / 6, 1 / 3]).peak == 3.0


@pytest.mark.parametrize(
    ("A", "tau", "why"),
    [
        ([0.5, 0.4], [0.0, 0.5], "sums to 0.9, but must sum to 1"),
        ([0.5, 0.5], [0.0, -0.5], "ascend from 0"),
        ([0.5, 0.5], [0.0], "shape"),
        ([math.nan, 1.0], [0.0, 0.5], "finite"),
    ],
)
def test_impulses_that_are_none_are_refused(A, tau, why):
    with pytest.raises(ImpulseError, match=why):
        custom("mine", A, tau)


def test_a_custom_shaper_keeps_to_the_validity_it_was_given():
    mine = custom("mine", [0.5, 0.5], [0.0, 0.5], zeta_max=0.1)
    with pytest.raises(ShaperRangeError, match=r"less than 0\.1"):
        mine.function(10.0, 0.1)
    with pytest.raises(FilterError, match=r"shaper 'mine' demands"):
        TvistFilter(mine, Fixed([10.0], [0.2]), joints=1)
    for f_d in (0.0, math.nan):
        with pytest.raises(ShaperRangeError, match="f_d"):
            custom("mine", [1.0], [0.0], f_d)
    for zeta_max in (0.0, 1.5, math.nan):
        with pytest.raises(DesignError, match="zeta_max"):
            custom("mine", [1.0], [0.0], zeta_max=zeta_max)


def test_a_band_is_in_units_of_the_assumed_frequency():
    low, high = band(SHAPERS["ei"].function(8.0, 0.1), 8.0, 0.1, 0.05)
    assert SHAPERS["ei"].band(0.05, 0.1) == pytest.approx((low / 8.0, high / 8.0))
