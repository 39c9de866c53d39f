"""A move from the stretched to the bent arm, the mode going from 6.7 to 15 Hz on the way."""

import numpy as np
import pytest

from tvist_shaping import Polynomial, TvistFilter, shaper, zv

H = 0.002  # [s]
STROKE = 5.0 * np.pi / 6.0  # [rad]
VELOCITY, ACCELERATION, JERK_TIME = 1.5, 2.0, 0.020  # [rad/s] [rad/s²] [s]


@pytest.fixture(scope="module")
def double_s():
    """A double-S move [rad] and rest: a ramp, twice averaged, is just that."""
    t = H * np.arange(int(3.6 / H))
    position = np.clip(VELOCITY * (t - 0.1), 0.0, STROKE)
    for window in (VELOCITY / ACCELERATION, JERK_TIME):
        n = round(window / H)
        position = np.convolve(position, np.ones(n) / n)[: t.size]
    position[-int(0.5 / H) :] = STROKE
    return position


@pytest.fixture
def modes():
    """From the paper's f_d and ζ of the stretched arm to those of the bent one, with the cosine of q."""
    bent = 1.0 - np.cos(STROKE)
    f_d, zeta = (15.0 - 6.7) / bent, (0.14 - 0.34) / bent
    return Polynomial(
        joints=[0],
        degree=1,
        f_d_coefficients=[6.7 + f_d, -f_d, 0.0],
        zeta_coefficients=[0.34 + zeta, -zeta, 0.0],
        f_d_range=(5.0, 17.0),
        zeta_range=(0.05, 0.45),
    )


def peak_acceleration(position):
    return np.abs(np.diff(position, 2)).max() / H**2


def shape(position, name, modes):
    tvist = TvistFilter(shaper(name), modes, joints=1, period=H)
    tvist.reset([position[0]])
    return np.array([tvist.filter([q])[0] for q in position])


def shape_with_rounded_delays(position, modes):
    """The foil: the same filter with its delays rounded to ticks."""
    shaped = [position[0]]
    for i in range(1, position.size):
        (f_d,), (zeta,) = modes.estimate(np.array([shaped[-1]]))
        impulses = zv(f_d, zeta)
        taps = np.maximum(i - np.rint(impulses.tau / H).astype(int), 0)
        shaped.append(impulses.A @ position[taps])
    return np.array(shaped)


def test_the_reference_is_a_double_s_of_the_papers_limits(double_s):
    assert peak_acceleration(double_s) == pytest.approx(ACCELERATION, rel=1e-6)
    assert np.abs(np.diff(double_s)).max() / H == pytest.approx(VELOCITY, rel=1e-6)


def test_while_the_frequency_sweeps_the_acceleration_stays_near_its_limit(double_s, modes):
    assert peak_acceleration(shape(double_s, "zv", modes)) < 2.1
    assert peak_acceleration(shape(double_s[::-1].copy(), "zv", modes)) < 2.1


def test_rounded_delays_kick_the_arm(double_s, modes):
    assert peak_acceleration(shape_with_rounded_delays(double_s, modes)) > 50.0
    assert peak_acceleration(shape_with_rounded_delays(double_s[::-1].copy(), modes)) > 50.0


@pytest.mark.parametrize("name", ["zv", "zvd", "ei", "ei_exact", "mzv", "si", "zvdd", "ei2", "zvddd", "ei3"])
def test_no_shaper_of_the_catalogue_kicks_the_arm_or_leaves_the_way_between_start_and_end(
    name, double_s, modes
):
    shaped = shape(double_s, name, modes)
    assert peak_acceleration(shaped) < 2.2
    assert shaped.min() >= -1e-6
    assert shaped.max() <= STROKE + 1e-6


def test_the_shaped_move_ends_where_the_reference_does_half_a_period_of_the_end_later(double_s, modes):
    shaped = shape(double_s, "zv", modes)
    assert shaped[-1] == double_s[-1]
    last = [np.flatnonzero(np.abs(np.diff(position)) > 1e-9)[-1] for position in (double_s, shaped)]
    assert H * (last[1] - last[0]) == pytest.approx(0.5 / 15.0, abs=2.0 * H)
