import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import product, zv
from tvist_shaping.taps import average, length, mean_delay, product_taps

H = 0.002
N = 140
modes = st.lists(st.tuples(st.floats(4.0, 60.0), st.floats(0.0, 0.9)), min_size=1, max_size=4)


def arrays(modes):
    f_d, zeta = np.array(modes, dtype=float).T.copy()
    return f_d, zeta


def tapped(modes, mean, taps=N):
    out = np.empty(taps)
    fits = product_taps(*arrays(modes), mean, H, out)
    return out, fits


@given(modes)
def test_the_mean_delay_is_that_of_the_product_of_the_impulses(modes):
    impulses = product([zv(*mode) for mode in modes])
    assert mean_delay(*arrays(modes)) == pytest.approx(impulses.mean_delay, rel=1e-12)


@given(modes, st.floats(0.0, 0.05))
def test_taps_sum_to_one_and_have_the_mean_delay_asked_for(modes, more):
    wanted = mean_delay(*arrays(modes)) + more
    taps, fits = tapped(modes, wanted, 400)
    assert fits
    assert taps.sum() == pytest.approx(1.0, abs=1e-12)
    assert H * np.arange(400) @ taps == pytest.approx(wanted, abs=1e-12)


@given(modes, st.floats(0.0, 0.05), st.floats(0.0, 1e4))
def test_taps_do_to_a_cubic_what_the_impulses_do(modes, more, seed):
    """Lagrange's cubic is exact for it: the same number as with delays between the ticks."""
    impulses = product([zv(*mode) for mode in modes])
    taps, _ = tapped(modes, impulses.mean_delay + more, 400)
    cubic = np.random.default_rng(int(seed)).normal(size=4)
    assert np.polyval(cubic, H * np.arange(400)) @ taps == pytest.approx(
        np.polyval(cubic, impulses.tau + more) @ impulses.A, abs=1e-10
    )


@given(modes, st.floats(0.0, 0.05))
def test_taps_leave_next_to_nothing_of_any_of_their_modes(modes, more):
    """What a cubic loses between two ticks grows with (f h)^4: 2 % of a mode of 60 Hz, nothing of a slow one."""
    taps, _ = tapped(modes, mean_delay(*arrays(modes)) + more, 400)
    last = length(taps)
    for f_d, zeta in modes:
        s = 2.0 * np.pi * f_d * (zeta / np.sqrt(1.0 - zeta**2) + 1j)
        waves = np.exp((s * np.arange(400) - s.real * last) * H)[: last + 1] * taps[: last + 1]
        assert abs(waves.sum()) < 0.05 * (abs(s) * H / 0.75) ** 4 + 1e-12


def test_a_product_that_lasts_longer_on_average_stands_and_says_so():
    taps, fits = tapped([(5.0, 0.0)], 0.04)
    assert not fits
    assert H * np.arange(N) @ taps == pytest.approx(0.05, abs=1e-12)
    assert taps.sum() == pytest.approx(1.0, abs=1e-12)


def test_an_impulse_beyond_the_last_tap_is_put_on_it_and_says_so():
    taps, fits = tapped([(2.0, 0.0)], 0.125, 60)
    assert not fits
    assert taps.sum() == pytest.approx(1.0, abs=1e-12)
    assert taps[0] == pytest.approx(0.5)
    assert taps[57] == pytest.approx(0.5)


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_three_running_means_are_a_convolution_with_three_boxes(ticks, seed):
    random = np.random.default_rng(seed)
    vectors = random.dirichlet(np.ones(5), size=80)
    start = vectors[0]
    past, sums, out = np.tile(start, (3, ticks, 1)), np.tile(ticks * start, (3, 1)), np.empty(5)
    box = np.ones(ticks) / ticks
    kernel = np.convolve(np.convolve(box, box), box)
    padded = np.vstack([np.tile(start, (kernel.size, 1)), vectors])
    for i, vector in enumerate(vectors):
        average(vector, past, sums, i % ticks, out)
        end = kernel.size + i + 1
        np.testing.assert_allclose(out, kernel[::-1] @ padded[end - kernel.size : end], atol=1e-13)


def test_running_sums_do_not_drift():
    random, ticks = np.random.default_rng(0), 32
    vectors = random.dirichlet(
        0.1 * np.ones(N), size=257
    )  # from nearly all on one tap to nearly all on another
    past, sums, out = np.tile(vectors[0], (3, ticks, 1)), np.tile(ticks * vectors[0], (3, 1)), np.empty(N)
    for i in range(100_000):
        average(vectors[i % 257], past, sums, i % ticks, out)
        if i % 9973 == 0:
            np.testing.assert_allclose(sums, past.sum(axis=1), rtol=0, atol=1e-13)
            mean = past[2].mean(axis=0)
            np.testing.assert_allclose(out, mean / mean.sum(), rtol=0, atol=1e-14)
    assert out.sum() == pytest.approx(1.0, abs=1e-14)


def test_the_length_is_the_last_tap_that_counts():
    assert length(np.array([0.0, 1.0, 1e-13, 0.0])) == 1
