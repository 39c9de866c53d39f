"""Streams as networks deliver them: jitter, loss, changed places, duplicates, bursts, clocks that disagree."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_controller.trajectory import MotionLimits, SetpointStream

from .robots import PAPER, H
from .streams import assert_within, minimum_jerk, network, played, swinging, there_and_back

TICKS = 2000
NEARLY = MotionLimits(0.95 * PAPER.velocity, 0.95 * PAPER.acceleration, 0.95 * PAPER.jerk)
MOTIONS = {
    "double-S": there_and_back(NEARLY),
    "sine": swinging([0.07, -0.05, 0.03]),
    "minimum jerk": minimum_jerk([1.2, -0.8]),
}


def start(motion, period, limits=PAPER):
    return SetpointStream(motion(np.zeros(1))[0], period, limits, H)


def follow(motion, period, limits=PAPER, **network_):
    stream = start(motion, period, limits)
    return stream, played(stream, network(motion, period, TICKS * H, **network_), TICKS)


def from_clean(out, clean):
    """Largest distance from a clean stream that is played out as late, whatever that is [rad]."""
    ticks = np.arange(len(out))
    columns = list(zip(out.T, clean.T, strict=True))
    return min(
        max(np.abs(one - np.interp(ticks - lag, ticks, other)).max() for one, other in columns)
        for lag in np.arange(-10.0, 30.0, 0.25)
    )


@pytest.mark.parametrize("name", MOTIONS)
def test_at_125_hz_jitter_and_loss_show_by_less_than_two_milliradians(name):
    _, clean = follow(MOTIONS[name], 0.008)
    for seed in range(3):
        stream, out = follow(MOTIONS[name], 0.008, seed=seed, jitter=1.0, loss=0.05, twice=0.03)
        assert_within(out)
        assert from_clean(out, clean) <= 2e-3
        assert stream.lost > 0
        assert stream.late > 0


@pytest.mark.parametrize("period", [H, 0.003, 0.004, 0.02, 0.05])
def test_limits_hold_at_every_rate(period):
    for name, motion in MOTIONS.items():
        _, out = follow(motion, period, seed=len(name), jitter=1.0, loss=0.05, twice=0.03)
        assert_within(out)


@pytest.mark.parametrize("period", [H, 0.008])
def test_a_stream_at_the_very_limits_comes_through_a_bad_network_whole(period):
    """What is missing in a ramp cannot be caught up with until the next one: some ten milliseconds of the way."""
    motion = there_and_back(PAPER)
    _, clean = follow(motion, period)
    for seed in range(3):
        _, out = follow(motion, period, seed=seed, jitter=1.0, loss=0.05)
        assert_within(out)
        assert from_clean(out, clean) <= 0.01 * PAPER.velocity


@pytest.mark.parametrize("clock", [-0.005, 0.005])
@pytest.mark.parametrize("period", [H, 0.008, 0.02])
def test_a_clock_that_is_half_a_percent_off_is_followed(period, clock):
    """The delay goes with it, smoothly: at 500 Hz most of a slow one are made up, of those a tick before."""
    motion = MOTIONS["sine"]
    stream, out = follow(motion, period, clock=clock, jitter=0.3)
    assert_within(out)
    count = TICKS * H / period
    assert stream.lost == 0
    assert stream.late <= 0.7 * count
    sent = TICKS * H / (1.0 + clock)
    wanted = motion(np.array([sent - 6 * period - 0.02, sent]))
    speed = 0.07 * 2 * np.pi * 0.8
    assert np.abs(out[-1] - wanted[1]).max() <= speed * (6 * period + 0.02)


@pytest.mark.parametrize("burst", [2, 5, 10])
def test_bursts_keep_the_limits_and_the_newest_wins(burst):
    motion = MOTIONS["sine"]
    stream, out = follow(motion, 0.008, burst=burst)
    assert_within(out)
    assert stream.sequence >= TICKS * H / 0.008 - 2 * burst - 4


@examples(30)
@given(
    seed=st.integers(0, 2**32 - 1),
    period=st.floats(H, 0.1),
    limits=st.builds(
        MotionLimits,
        velocity=st.floats(1e-3, 3.14),
        acceleration=st.floats(1e-2, 40.0),
        jerk=st.floats(0.1, 2000.0),
    ),
    jitter=st.floats(0.0, 10.0),
    wildness=st.sampled_from([0.0, 1e-4, 0.1, 6.0]),
)
def test_whatever_comes_stays_finite_in_range_and_inside_the_limits(seed, period, limits, jitter, wildness):
    random = np.random.default_rng(seed)
    reach = np.full(2, 6.3)
    swing = swinging([0.3, -0.2], 1.0, 0.3)

    def motion(times):
        return np.clip(swing(times) + wildness * random.normal(size=(len(times), 2)), -6.28, 6.28)

    arrivals = network(
        motion, period, 1.0, seed=seed, jitter=jitter, loss=0.2, twice=0.2, burst=random.integers(1, 12)
    )
    stream = SetpointStream(np.zeros(2), period, limits, H, reach=reach)
    out = played(stream, arrivals, 700)
    velocity, acceleration, jerk = (np.abs(np.diff(out, n, axis=0)).max() / H**n for n in (1, 2, 3))
    assert np.isfinite(out).all()
    assert (np.abs(out) <= reach).all()
    assert velocity <= limits.velocity * (1 + 1e-5) + 2 * limits.acceleration * H
    assert acceleration <= limits.acceleration * (1 + 1e-5) + 1e-8
    assert jerk <= limits.jerk * (1 + 1e-4) + 1e-5
