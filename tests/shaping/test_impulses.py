import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import SHAPERS, ImpulseError, Impulses, ShaperRangeError, product, residual, zv, zvd

frequencies = st.floats(1e-6, 1e6)
shares = st.floats(0.0, 1.0, exclude_max=True)
shapers = st.sampled_from(list(SHAPERS.values()))


def test_amplitudes_and_times_equal_the_golden_values(golden):
    for entry in golden["shapers"]:
        impulses = SHAPERS[entry["name"]].function(entry["f_d"], entry["zeta"])
        np.testing.assert_allclose(impulses.A, entry["A"], rtol=0, atol=1e-6, err_msg=str(entry))
        np.testing.assert_allclose(impulses.tau, entry["tau"], rtol=0, atol=1e-6, err_msg=str(entry))


def test_zv_equals_equations_4_to_7_of_the_paper():
    K = math.exp(-0.34 * math.pi / math.sqrt(1.0 - 0.34**2))
    impulses = zv(6.7, 0.34)
    assert pytest.approx(0.321163, abs=1e-6) == K
    np.testing.assert_allclose(impulses.A, [1.0 / (1.0 + K), K / (1.0 + K)], rtol=1e-15)
    np.testing.assert_allclose(impulses.tau, [0.0, 0.5 / 6.7], rtol=1e-15)


@given(shapers, frequencies, shares)
def test_every_train_passes_the_constructors_own_checks_and_sums_to_one(shaper, f_d, share):
    impulses = shaper.function(f_d, share * shaper.zeta_max)
    checked = Impulses(impulses.A, impulses.tau)
    assert abs(checked.A.sum() - 1.0) < 1e-14
    assert np.abs(checked.A).sum() <= shaper.peak + 1e-12


@given(shapers, st.floats(1.0, 100.0), shares)
def test_no_train_lasts_longer_than_the_catalogue_says(shaper, f_d, share):
    assert shaper.function(f_d, share * shaper.zeta_max).duration <= shaper.duration_periods / f_d * (
        1 + 1e-8
    )


@pytest.mark.parametrize("name", SHAPERS)
def test_the_duration_that_the_catalogue_says_is_reached(name):
    entry = SHAPERS[name]
    longest = max(entry.function(1.0, share * entry.zeta_max).duration for share in (0.0, 1.0 - 1e-9))
    assert longest == pytest.approx(entry.duration_periods, rel=1e-8)


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize("f_d", [0.0, -1.0, math.nan, math.inf, 1e-7, 1e7])
def test_a_bad_frequency_is_named_with_its_value_and_limit(name, f_d):
    with pytest.raises(ShaperRangeError, match=r"f_d is .* must be 1e-06 to 1e\+06 Hz") as error:
        SHAPERS[name].function(f_d, 0.1)
    assert error.value.field == "f_d"
    assert error.value.value == pytest.approx(f_d, nan_ok=True)
    assert "1e-06" in error.value.limit


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize("zeta", [-0.01, 1.0, 2.0, math.nan, math.inf])
def test_a_bad_damping_is_named_with_its_value_and_limit(name, zeta):
    with pytest.raises(ShaperRangeError, match=r"zeta is .* must be at least 0 and less than") as error:
        SHAPERS[name].function(10.0, zeta)
    assert error.value.field == "zeta"
    assert error.value.value == pytest.approx(zeta, nan_ok=True)
    assert f"less than {SHAPERS[name].zeta_max:g}" in error.value.limit


@pytest.mark.parametrize("name", [name for name, entry in SHAPERS.items() if entry.zeta_max < 1.0])
def test_a_damping_beyond_a_shapers_validity_is_refused_with_what_to_take(name):
    entry = SHAPERS[name]
    entry.function(10.0, entry.zeta_max * (1 - 1e-12))
    with pytest.raises(ShaperRangeError, match=r"beyond it take (ei|zv)"):
        entry.function(10.0, entry.zeta_max)


@pytest.mark.parametrize(
    ("A", "tau", "why"),
    [
        ([0.5, 0.5], [0.0], "shape"),
        ([], [], "shape"),
        ([[1.0]], [[0.0]], "shape"),
        ([0.5, math.nan], [0.0, 1.0], "A is .* finite"),
        ([0.5, 0.5], [0.0, math.inf], "tau is .* finite"),
        ([0.5, 0.5], [0.1, 1.0], "ascend from 0"),
        ([0.4, 0.3, 0.3], [0.0, 1.0, 0.5], "ascend from 0"),
        ([0.5, 0.5 + 2e-9], [0.0, 1.0], "sum to 1"),
    ],
)
def test_what_is_no_train_of_impulses_is_refused(A, tau, why):
    with pytest.raises(ImpulseError, match=why):
        Impulses(A, tau)


def test_impulses_are_read_only_and_their_own():
    A = np.array([0.5, 0.5])
    made = Impulses(A, [0.0, 1.0])
    A[0] = 7.0
    assert made.A[0] == 0.5
    for train in (made, zv(10.0, 0.1), product([zv(10.0, 0.1), zvd(7.0, 0.2)])):
        for values in (train.A, train.tau):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 1.0
        with pytest.raises(AttributeError):
            train.A = A


def test_mean_delay_is_the_centroid():
    assert zv(10.0, 0.0).mean_delay == pytest.approx(0.025)
    assert zvd(10.0, 0.0).mean_delay == pytest.approx(0.05)


def test_a_product_suppresses_each_of_its_modes():
    both = product([zv(7.0, 0.3), zv(19.0, 0.1)])
    Impulses(both.A, both.tau)
    assert both.duration == pytest.approx(0.5 / 7.0 + 0.5 / 19.0)
    assert residual(7.0, 0.3, both) < 1e-15
    assert residual(19.0, 0.1, both) < 1e-15


def test_a_product_is_the_convolution():
    three = product([zv(7.0, 0.3), zvd(7.0, 0.3), zv(19.0, 0.1)])
    Impulses(three.A, three.tau)
    assert three.A.size == 12
    f = np.linspace(0.0, 40.0, 50)

    def spectrum(train):
        return np.exp(-2j * np.pi * f[:, None] * train.tau) @ train.A

    factors = spectrum(zv(7.0, 0.3)) * spectrum(zvd(7.0, 0.3)) * spectrum(zv(19.0, 0.1))
    np.testing.assert_allclose(spectrum(three), factors, atol=1e-14)


def test_a_product_of_one_is_itself_and_of_none_an_error():
    train = zv(7.0, 0.3)
    np.testing.assert_array_equal(product([train]).A, train.A)
    with pytest.raises(ImpulseError, match="at least one"):
        product([])
