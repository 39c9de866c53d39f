"""RV is the amplitude of the vibration at the stop."""

import numpy as np
import pytest

from tvist_lab.metrics import NotMeasurableError, motions, residual

STOP = 501
TICKS = 1500


def rung(one_motion, alpha, **columns):
    recording = one_motion(alpha=alpha, **columns)
    return recording, motions(recording)[0]


@pytest.mark.parametrize(("f_d", "zeta"), [(15.0, 0.14), (10.0, 0.05), (6.7, 0.1), (25.0, 0.03)])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (1.0, -2.0, 0.5)])
def test_rv_of_an_exact_damped_sine_is_its_amplitude(one_motion, ring, f_d, zeta, axis):
    recording, motion = rung(one_motion, ring(TICKS, STOP, f_d, zeta, 1.2, axis=axis))
    rv = residual(recording, motion)
    assert rv.fitted
    sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
    # The peaks of |e^(-σt) cos ωt| come before ωt = kπ and lie √(1-ζ²) below the envelope.
    assert rv.value == pytest.approx(1.2 * np.sqrt(1.0 - zeta**2), rel=0.04)
    assert rv.decay == pytest.approx(sigma, rel=0.1)
    assert rv.stop == pytest.approx(0.002 * STOP)


def test_peaks_are_read_through_the_noise_of_the_sensor(one_motion, ring):
    values = []
    for seed in range(10):
        noise = 0.03 * np.random.default_rng(seed).standard_normal((TICKS, 3))
        recording, motion = rung(one_motion, ring(TICKS, STOP, 15.0, 0.08, 1.0, axis=(1.0, 1.0, 0.0)) + noise)
        values.append(residual(recording, motion).value)
    assert np.mean(values) == pytest.approx(1.0, rel=0.1)


def test_fewer_than_two_peaks_give_the_largest_value_and_say_so(one_motion, ring):
    recording, motion = rung(one_motion, ring(TICKS, STOP, 6.7, 0.34, 0.3))
    rv = residual(recording, motion)
    assert not rv.fitted
    assert np.isnan(rv.decay)
    first_after_the_stop = np.linalg.norm(ring(TICKS, STOP, 6.7, 0.34, 0.3)[STOP + 1])
    assert rv.value == pytest.approx(first_after_the_stop)
    np.testing.assert_allclose(rv.curve(np.array([1.1, 1.2])), rv.value)


def test_ripples_below_the_prominence_are_no_peaks(one_motion, ring):
    recording, motion = rung(one_motion, ring(TICKS, STOP, 15.0, 0.02, 0.09))
    assert not residual(recording, motion).fitted


def test_the_tick_of_the_stop_itself_does_not_count(one_motion):
    alpha = np.zeros((TICKS, 3))
    alpha[: STOP + 1, 0] = 5.0
    recording, motion = rung(one_motion, alpha)
    assert residual(recording, motion).value == pytest.approx(0.0, abs=1e-12)


def test_only_the_three_tenths_of_a_second_after_the_shaped_stop_count(one_motion):
    alpha = np.zeros((TICKS, 3))
    alpha[STOP + 40 + 152 :, 0] = 5.0
    recording, motion = rung(one_motion, alpha, shaped_ticks=40)
    assert residual(recording, motion).value == pytest.approx(0.0, abs=1e-12)


def test_peaks_that_grow_are_fitted_by_a_constant_not_by_a_growing_exponential(one_motion):
    alpha = np.zeros((TICKS, 3))
    alpha[STOP + 20, 0], alpha[STOP + 60, 0] = 0.2, 0.3
    recording, motion = rung(one_motion, alpha)
    rv = residual(recording, motion)
    assert rv.decay == pytest.approx(0.0, abs=1e-6)
    assert rv.value == pytest.approx(0.25, rel=1e-3)


def test_a_recording_that_ends_too_early_is_not_measurable(one_motion):
    recording = one_motion(ticks=600)
    with pytest.raises(NotMeasurableError, match=r"only 0\.196 s were recorded after the stop"):
        residual(recording, motions(recording)[0])
