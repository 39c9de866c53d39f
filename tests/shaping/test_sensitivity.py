import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import SHAPERS, ShaperRangeError, ShapingError, band, ei, none, residual, zv, zvd


def test_what_is_left_at_the_design_equals_the_golden_values(golden):
    for entry in golden["shapers"]:
        impulses = SHAPERS[entry["name"]].function(entry["f_d"], entry["zeta"])
        left = residual(entry["f_d"], entry["zeta"], impulses)
        assert left == pytest.approx(entry["V_at_design"], abs=5e-5), entry


def test_figure_4_comes_out_to_a_two_hundredth_of_a_percent(golden):
    for name, row in golden["sensitivity_undamped_10_5_hz"].items():
        f = np.array([float(f) for f in row])
        percent = 100.0 * residual(f, 0.0, SHAPERS[name].function(10.5, 0.0))
        np.testing.assert_allclose(percent, list(row.values()), rtol=0, atol=0.00501, err_msg=name)


def test_an_ei_shaper_in_the_middle_cannot_guarantee_less_than_36_percent_from_6_to_15_hz():
    left = residual(np.linspace(6.0, 15.0, 901), 0.0, ei(10.5, 0.0))
    assert 100.0 * left.max() == pytest.approx(35.82, abs=0.005)
    assert left[0] == pytest.approx(left[-1])


@given(st.floats(0.0, 40.0))
def test_the_undamped_curves_equal_their_closed_forms(f):
    r = np.pi * f / 10.0
    assert residual(f, 0.0, zv(10.0, 0.0)) == pytest.approx(abs(math.cos(r / 2.0)), abs=1e-13)
    assert residual(f, 0.0, zvd(10.0, 0.0)) == pytest.approx(math.cos(r / 2.0) ** 2, abs=1e-13)
    assert residual(f, 0.0, ei(10.0, 0.0)) == pytest.approx(abs(0.475 + 0.525 * math.cos(r)), abs=1e-13)


@given(st.floats(0.0, 1e4), st.floats(0.0, 0.999))
def test_without_shaping_everything_is_left(f, zeta):
    assert residual(f, zeta, none(10.0, 0.0)) == 1.0


def test_f_may_have_any_shape():
    assert residual(7.0, 0.1, zv(7.0, 0.1)).shape == ()
    assert residual(np.ones((2, 3)), 0.1, zv(7.0, 0.1)).shape == (2, 3)


@pytest.mark.parametrize("name", ["zv", "mzv", "zvd", "ei", "zvdd", "ei2", "zvddd", "ei3"])
@pytest.mark.parametrize("percent", [5, 10])
def test_the_bands_are_those_of_the_golden_table(name, percent, golden):
    low, high = golden["bands_undamped"][name][str(percent)]
    impulses = SHAPERS[name].function(8.0, 0.0)
    assert band(impulses, 8.0, 0.0, percent / 100) == pytest.approx((8.0 * low, 8.0 * high), abs=1e-3)
    assert SHAPERS[name].band(percent / 100) == pytest.approx((low, high), abs=1e-4)


# Allowed errors of the frequency for 5 %, in percent, as published.
PRINTERS = {"mzv": (-4, 4), "zvd": (-15, 15), "ei": (-20, 20), "ei2_exact": (-40, 45), "ei3_exact": (-50, 60)}
DRIVES = {"zv": (-3, 3), "zvd": (-13, 19)}


@pytest.mark.parametrize(("name", "published"), [*PRINTERS.items(), *DRIVES.items()])
def test_the_bands_at_a_damping_of_a_tenth_are_near_those_that_others_publish(name, published):
    """Klipper's documentation, whose two- and three-hump shapers are damped exactly, and Beckhoff's TF5250."""
    low, high = SHAPERS[name].band(0.05, 0.1)
    assert (100 * (low - 1), 100 * (high - 1)) == pytest.approx(published, abs=3.6)


def test_damping_never_narrows_a_band_nor_raises_what_is_left_at_the_design():
    for shaper in (SHAPERS[name] for name in ("zv", "mzv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3")):
        widths, lefts = [], []
        for zeta in np.arange(0.0, 0.95, 0.05):
            impulses = shaper.function(1.0, zeta)
            low, high = band(impulses, 1.0, zeta, 0.05)
            widths.append(high - low)
            lefts.append(residual(1.0, zeta, impulses))
        assert all(later >= earlier for earlier, later in pairwise(widths)), shaper.name
        assert all(later <= earlier + 1e-12 for earlier, later in pairwise(lefts)), shaper.name


def test_a_band_without_an_end_is_infinite_and_one_without_its_middle_is_none():
    assert band(zvd(1.0, 0.9), 1.0, 0.9, 0.05)[1] == math.inf
    assert all(map(math.isnan, band(none(1.0, 0.0), 1.0, 0.0, 0.05)))


def test_bad_input_is_named():
    train = zv(1.0, 0.0)
    for f in (-1.0, math.nan, math.inf):
        with pytest.raises(ShaperRangeError, match="f is"):
            residual(f, 0.0, train)
        with pytest.raises(ShaperRangeError, match="f_d is"):
            band(train, f, 0.0, 0.05)
    for zeta in (-0.1, 1.0, math.nan):
        with pytest.raises(ShaperRangeError, match="zeta is"):
            residual(1.0, zeta, train)
    for V in (0.0, 1.0, math.nan):
        with pytest.raises(ShapingError, match="V is"):
            band(train, 1.0, 0.0, V)
