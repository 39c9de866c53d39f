import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import SHAPERS, DesignError, ShaperRangeError, band, ei, ei_exact, ei_of, residual
from tvist_shaping.amplitudes import ripple
from tvist_shaping.exact import EI, EI2, EI3, HumpShaper
from tvist_shaping.unity import UM_ZV, UM_ZVD

NAMES = ("ei_exact", "ei2_exact", "ei3_exact")

# Singhose's third-degree fits for V = 5 % as printer firmware has them: t and A, a row an impulse, a column a power
# of ζ. Klipper takes the times in undamped periods, RepRapFirmware in damped ones.
TWO = (
    [(0.49890, 0.16270, -0.54262, 6.16180), (0.99748, 0.18382, -1.58270, 8.17120),
     (1.49920, -0.09297, -0.28338, 1.85710)],
    [(0.16054, 0.76699, 2.26560, -1.22750), (0.33911, 0.45081, -2.58080, 1.73650),
     (0.34089, -0.61533, -0.68765, 0.42261), (0.15997, -0.60246, 1.00280, -0.93145)],
)  # fmt: skip
THREE = (
    [(0.49974, 0.23834, 0.44559, 12.4720), (0.99849, 0.29808, -2.36460, 23.3990), (1.49870, 0.10306, -2.01390, 17.0320),
     (1.99960, -0.28231, 0.61536, 5.40450)],
    [(0.11275, 0.76632, 3.29160, -1.44380), (0.23698, 0.61164, -2.57850, 4.85220),
     (0.30008, -0.19062, -2.14560, 0.13744), (0.23775, -0.73297, 0.46885, -2.08650),
     (0.11244, -0.45439, 0.96382, -1.46000)],
)  # fmt: skip


def fitted(table, zeta):
    t, A = (np.array(rows) @ zeta ** np.arange(4) for rows in table)
    return A, np.concatenate([[0.0], t])


def test_the_damped_ei_is_the_golden_one(golden):
    for entry in golden["ei_exact"]:
        impulses = ei_exact(1.0, entry["zeta"])
        np.testing.assert_allclose(impulses.A, entry["A"], rtol=0, atol=1e-6, err_msg=str(entry))
        np.testing.assert_allclose(impulses.tau, entry["periods"], rtol=0, atol=1e-6, err_msg=str(entry))
        assert residual(1.0, entry["zeta"], impulses) == pytest.approx(0.05, abs=1e-8)
        assert band(impulses, 1.0, entry["zeta"], 0.05) == pytest.approx(entry["band"], abs=2e-3)


@pytest.mark.parametrize(("name", "table", "highest"), [("ei2_exact", TWO, 0.3), ("ei3_exact", THREE, 0.19)])
def test_two_and_three_humps_are_the_published_fits_in_undamped_periods(name, table, highest):
    for zeta in np.linspace(0.0, highest, 8):
        A, t = fitted(table, zeta)
        impulses = SHAPERS[name].function(1.0, zeta)
        np.testing.assert_allclose(impulses.A, A, atol=1.5e-3)
        # T_n = T_d √(1-ζ²). The fit of the fifth impulse's time is a bad one: there the humps are not equal.
        inner, last = np.split(np.abs(impulses.tau - t * math.sqrt(1.0 - zeta**2)), [4])
        assert inner.max() < 5e-3
        assert (last < 0.05).all()


def test_the_durations_that_are_written_down_are_those_of_the_equations():
    for shaper in (EI, EI2, EI3, UM_ZV, UM_ZVD):
        assert shaper.longest() == shaper.duration_periods


def test_in_damped_periods_the_published_times_are_wrong():
    A, t = fitted(TWO, 0.3)
    assert np.abs(ei2(0.3).tau - t).max() > 0.05
    left = [
        abs(A @ np.exp(2 * np.pi * (0.3 / math.sqrt(0.91) * (x - x[-1]) + 1j * x)))
        for x in (t * math.sqrt(0.91), t)
    ]
    assert left[0] < 1e-3
    assert left[1] > 5e-3


def ei2(zeta):
    return SHAPERS["ei2_exact"].function(1.0, zeta)


@pytest.mark.parametrize("name", NAMES)
def test_without_damping_they_are_the_shapers_with_closed_forms(name):
    exact, closed = (SHAPERS[n].function(7.0, 0.0) for n in (name, name.removesuffix("_exact")))
    np.testing.assert_allclose(exact.A, closed.A, atol=1e-7)
    np.testing.assert_allclose(exact.tau, closed.tau, atol=1e-7)


@examples(40)
@given(st.sampled_from(NAMES), st.floats(0.0, 0.98), st.floats(0.5, 50.0))
def test_every_hump_is_five_percent_high_and_between_them_it_is_zero(name, share, f_d):
    zeta = share * SHAPERS[name].zeta_max
    impulses = SHAPERS[name].function(f_d, zeta)
    low, high = band(impulses, f_d, zeta, 0.05 * (1.0 + 1e-5))
    left = residual(np.linspace(low, min(high, 3.0 * f_d), 20001), zeta, impulses)
    count = {"ei_exact": 1, "ei2_exact": 2, "ei3_exact": 3}[name]
    humps = np.flatnonzero((left[1:-1] > left[:-2]) & (left[1:-1] >= left[2:])) + 1
    np.testing.assert_allclose(left[humps[:count]], [0.05] * count, atol=1e-6)
    valleys = np.flatnonzero((left[1:-1] < left[:-2]) & (left[1:-1] <= left[2:])) + 1
    assert len(valleys) == count + 1
    assert left[valleys].max() < 1e-3


def test_with_damping_they_forgive_more_than_amplitudes_that_only_decay():
    for name in NAMES:
        for zeta in (0.05, 0.1, 0.15, 0.19):
            own, decayed = (
                SHAPERS[n].band(0.05 * (1 + 1e-6), zeta) for n in (name, name.removesuffix("_exact"))
            )
            assert own[1] - own[0] > decayed[1] - decayed[0], (name, zeta)


@pytest.mark.parametrize("name", NAMES)
def test_they_vary_smoothly_with_the_damping(name):
    entry = SHAPERS[name]
    zeta = np.linspace(0.0, entry.zeta_max * (1 - 1e-12), 2001)
    trains = [entry.function(1.0, z) for z in zeta]
    for values in (np.array([train.A for train in trains]), np.array([train.tau for train in trains])):
        steps = np.abs(np.diff(values, axis=0)).max(axis=1)
        assert steps.max() < 6.0 * steps[0] + 1e-3


@pytest.mark.parametrize(("humps", "name"), [(1, "ei_exact"), (2, "ei2_exact"), (3, "ei3_exact")])
def test_the_validity_in_the_catalogue_is_where_the_highest_zero_is_at_its_limit(humps, name):
    assert SHAPERS[name].zeta_max == HumpShaper(humps, 0.05).limit()


@pytest.mark.parametrize("V", [0.2, 0.2245, 0.225, 0.22509])
def test_the_hump_has_its_height_where_the_equations_end_just_beyond_the_highest_damping(V):
    made = ei_of(1, V, exact=True)
    for part in np.linspace(0.0, 0.999, 41):
        assert residual(1.0, part * made.zeta_max, made.function(1.0, part * made.zeta_max)) == pytest.approx(
            V, rel=1e-6
        )


@examples(10)
@given(st.integers(1, 4), st.floats(0.005, 0.3))
@example(1, 0.225)
def test_any_number_of_humps_of_any_height_can_be_had(humps, V):
    made = ei_of(humps, V, exact=True)
    zeta = 0.7 * made.zeta_max
    impulses = made.function(1.0, zeta)
    low, high = made.band(V * (1 + 1e-5), zeta)
    closed = ei_of(humps, V).band(V * (1 + 1e-5), zeta)
    assert high - low >= closed[1] - closed[0]
    left = residual(np.linspace(low, high, 5001), zeta, impulses)
    assert left.max() == pytest.approx(V, rel=1e-4)
    assert made.duration_periods == pytest.approx((humps + 1) / 2, rel=0.03)
    for part in np.linspace(0.0, 0.999, 50):
        assert made.function(1.0, part * made.zeta_max).duration <= made.duration_periods * (1 + 1e-6)
    with pytest.raises(ShaperRangeError, match=rf"take ei_of\({humps}, "):
        made.function(1.0, made.zeta_max)


@given(st.integers(1, 3), st.floats(0.001, 0.4))
def test_equal_ripples_are_the_closed_forms_of_the_literature(humps, V):
    X = math.cbrt(V * V * (math.sqrt(1.0 - V * V) + 1.0))
    two = (3.0 * X * X + 2.0 * X + 3.0 * V * V) / (16.0 * X)
    three = (1.0 + 3.0 * V + 2.0 * math.sqrt(2.0 * (V + V * V))) / 16.0
    side = (1.0 - V) / 4.0
    known = {
        1: ((1.0 + V) / 4.0, (1.0 - V) / 2.0, (1.0 + V) / 4.0),
        2: (two, 0.5 - two, 0.5 - two, two),
        3: (three, side, 1.0 - 2.0 * (three + side), side, three),
    }
    np.testing.assert_allclose(ripple(humps, V), known[humps], atol=1e-12)


def test_amplitudes_that_only_decay_leave_less_than_they_may(golden):
    for entry in golden["shapers"]:
        if entry["name"] == "ei" and entry["zeta"] > 0.0:
            assert residual(entry["f_d"], entry["zeta"], ei(entry["f_d"], entry["zeta"])) < 0.04


@pytest.mark.parametrize(("humps", "V"), [(0, 0.05), (11, 0.05), (1, 0.0), (1, 0.9), (1, math.nan)])
def test_bad_humps_are_named(humps, V):
    for exact in (False, True):
        with pytest.raises(DesignError, match=r"(humps|V) is .*, but must be"):
            ei_of(humps, V, exact=exact)
