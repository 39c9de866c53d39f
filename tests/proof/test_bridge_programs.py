"""Programs in front of a bridge: what they ask for, and how their ring is measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from proof.bridge.goals import ACCELERATION, HOME, SPEED, goals, trapezoid
from proof.bridge.ring import Stop, compared

from tvist_plant.plant import PERIOD

seeds = st.integers(0, 2**31 - 1)


@given(seeds, st.sampled_from([0.002, 0.008, 0.05]))
def test_what_they_stream_keeps_speed_and_acceleration_and_ends_at_the_goal(seed, period):
    start = HOME
    for goal in goals(seed):
        way = np.array([start, start, *trapezoid(start, goal, period), goal, goal])
        assert np.abs(np.diff(way, axis=0)).max() <= SPEED * period + 1e-9
        assert np.abs(np.diff(way, 2, axis=0)).max() <= ACCELERATION * period**2 + 1e-9
        start = goal


def stopped(q, amplitude, seconds, noise=0.0):
    """A stop at joint angles `q` after which the tool swings at 5 Hz."""
    time = np.arange(0.0, seconds, PERIOD)
    swing = amplitude * np.sin(2.0 * np.pi * 5.0 * time)
    alpha = np.column_stack([swing, 0.0 * swing, 0.0 * swing])
    return Stop(
        np.full(6, q),
        min(seconds, 0.3),
        alpha + np.random.default_rng(0).normal(0.0, noise, alpha.shape),
        PERIOD,
    )


@given(st.floats(0.3, 2.0), st.floats(0.0, 1.0))
def test_noise_is_no_ring(amplitude, share):
    per_axis = 0.02
    direct, shaped = (stopped(1.0, a, 1.0, per_axis) for a in (amplitude, share * amplitude))
    ((before, after),) = compared([direct], [shaped], per_axis * 3.0**0.5)
    assert before == pytest.approx(amplitude / 2.0**0.5, rel=0.1)
    assert after == pytest.approx(share * amplitude / 2.0**0.5, abs=0.03)


def test_only_stops_at_the_same_place_are_compared_and_over_the_same_time():
    direct = [stopped(1.0, 1.0, 0.1), stopped(2.0, 1.0, 1.0)]
    other = [stopped(1.0, 0.1, 1.0), stopped(1.5, 0.1, 1.0), stopped(2.0, 0.1, 1.0)]
    rings = compared(direct, other, 0.0)
    assert [after / before for before, after in rings] == pytest.approx([0.1, 0.1])
