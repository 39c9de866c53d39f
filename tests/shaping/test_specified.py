import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from tests.examples import examples

from tvist_shaping import SHAPERS, DesignError, ShaperRangeError, residual, si_of
from tvist_shaping.specified import specified


def least_that_a_train_must_leave(low, high, duration):
    """Frequency sampling: the linear programme over symmetric trains on a fine grid of times, by another solver."""
    x = np.linspace(0.0, duration / 2.0, 241)
    f = np.linspace(low, high, 121)
    cosines = np.cos(2.0 * np.pi * np.outer(f, x))
    bound = -np.ones((f.size, 1))
    found = linprog(
        np.append(np.zeros(x.size), 1.0),
        np.block([[cosines, bound], [-cosines, bound]]),
        np.zeros(2 * f.size),
        np.append(np.ones(x.size), 0.0)[None],
        [1.0],
    )
    return found.fun


@examples(25)
@given(st.floats(0.01, 1.2), st.sampled_from([0.02, 0.05, 0.1]))
def test_it_leaves_what_it_may_in_its_band_and_no_shorter_train_does(width, V):
    low, high = 1.0 - width / 2.0, 1.0 + width / 2.0
    a, tau = specified(low, high, V)
    left = np.abs(np.exp(2j * np.pi * np.outer(np.linspace(low, high, 4001), tau)) @ a)
    assert left.max() == pytest.approx(V, rel=1e-6)
    assert a.min() > 0.0
    assert a.sum() == pytest.approx(1.0, abs=1e-12)
    assert (np.diff(tau) > 0.0).all()
    np.testing.assert_allclose(a, a[::-1], atol=1e-12)
    # The samples leave the programme a little freedom between them.
    assert least_that_a_train_must_leave(low, high, tau[-1]) > 0.997 * V
    assert least_that_a_train_must_leave(low, high, 0.97 * tau[-1]) > 1.001 * V


@pytest.mark.parametrize("name", ["zv", "ei", "ei2", "ei3"])
def test_asked_for_the_band_of_a_known_shaper_it_is_that_shaper(name):
    low, high = SHAPERS[name].band()
    a, tau = specified(low + 1e-7, high - 1e-7, 0.05)
    known = SHAPERS[name].function(1.0, 0.0)
    np.testing.assert_allclose(a, known.A, atol=1e-5)
    np.testing.assert_allclose(tau, known.tau, atol=1e-5)


def test_the_numbers_of_si_are_those_of_its_band():
    made = si_of(0.75, 1.25)
    assert (made.zeta_max, made.peak) == (SHAPERS["si"].zeta_max, SHAPERS["si"].peak)
    np.testing.assert_allclose(SHAPERS["si"].train, made.train, rtol=0, atol=1e-12)


def test_a_wider_band_takes_a_longer_train():
    durations = [specified(1.0 - w / 2.0, 1.0 + w / 2.0, 0.05)[1][-1] for w in np.linspace(0.01, 1.5, 150)]
    assert (np.diff(durations) > 0.0).all()


@examples(25)
@given(st.floats(0.55, 0.97), st.floats(1.03, 1.4), st.sampled_from([0.05, 0.1]), st.floats(0.0, 0.999))
def test_with_damping_it_keeps_its_word_as_far_as_it_says(low, high, V, share):
    made = si_of(low, high, V)
    zeta = share * made.zeta_max
    left = residual(np.linspace(low, high, 500), zeta, made.function(1.0, zeta))
    assert left.max() <= V * (1.0 + 1e-3)


def test_where_it_would_leave_more_it_says_so():
    wide = si_of(0.5, 1.5)
    assert 0.0 < wide.zeta_max < 0.3
    with pytest.raises(ShaperRangeError, match=r"zeta is 0\.34.*take a higher V or ei_of"):
        wide.function(10.0, 0.34)


def test_the_paper_workspace_can_be_had_with_one_shaper_at_the_price_of_its_length():
    """6 to 15 Hz at any damping: 1.8 periods of the middle, where the time-varying filter has half a period."""
    made = si_of(6.0 / 10.5, 15.0 / 10.5)
    assert made.zeta_max == 1.0
    for zeta in (0.0, 0.1, 0.34):
        assert residual(np.linspace(6.0, 15.0, 901), zeta, made.function(10.5, zeta)).max() <= 0.05 * (
            1 + 1e-4
        )
    assert made.duration_periods < SHAPERS["ei3"].duration_periods


@pytest.mark.parametrize(
    ("numbers", "field"),
    [
        ({"low": 0.0}, "low"),
        ({"low": 1.1}, "low"),
        ({"low": float("nan")}, "low"),
        ({"high": 0.9}, "high"),
        ({"high": float("inf")}, "high"),
        ({"V": 0.0}, "V"),
        ({"V": 0.6}, "V"),
        ({"low": 0.1, "high": 3.0}, "band"),
    ],
)
def test_a_band_that_is_none_is_refused_by_name(numbers, field):
    with pytest.raises(DesignError, match=rf"{field} is .*, but must be") as error:
        si_of(**numbers)
    assert error.value.field == field
