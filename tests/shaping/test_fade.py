"""From one filter to another in motion: no step, nothing beyond the limits, and it comes to an end."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import SHAPERS, Fade, FilterError, Fixed, Polynomial, ShapingError, TvistFilter, shaper

from .motions import ACCELERATION, JERK, VELOCITY, H, double_s

TOLERANCE = 1e-6
"""Share of a limit that is rounding."""
STREAMED = 1e-4
"""Likewise in a stream, where one of a thousand exceeds rounding: the fade may have to wait for room."""
names = st.sampled_from([n for n, entry in SHAPERS.items() if entry.zeta_max > 0.5 and entry.peak == 1.0])
seeds = st.integers(0, 2**32 - 1)
VARYING = Polynomial(
    joints=[0],
    degree=1,
    f_d_coefficients=[11.0, -4.3, 0.0],
    zeta_coefficients=[0.24, 0.1, 0.0],
    f_d_range=(5.0, 17.0),
    zeta_range=(0.05, 0.5),
)


def a_filter(random, name, joints=3):
    estimator = (
        VARYING if random.random() < 0.3 else Fixed([random.uniform(5, 15)], [random.uniform(0.02, 0.4)])
    )
    return TvistFilter(shaper(name), estimator, joints=joints)


def fade(old, new, velocity=VELOCITY, acceleration=ACCELERATION, jerk=JERK):
    return Fade(old, new, velocity=velocity, acceleration=acceleration, jerk=jerk)


def run(reference, old, new, switch):
    """Output; share of the new filter; what each filter alone gave, the new one from the switch on."""
    output, shares, alone = [], [], []
    fading = None
    for tick, x in enumerate(reference):
        if tick == switch:
            fading = fade(old, new)
        shaped = old.filter(x) if fading is None else fading.filter(x)
        output.append(shaped)
        shares.append(0.0 if fading is None else fading.share)
        both = (shaped, shaped) if fading is None or fading.finished else fading._history[:2, 2]
        alone.append(np.array(both))
    return np.array(output), np.array(shares), np.array(alone)


def excess(output, alone, order, limit):
    """Largest derivative over the larger of the limit and what the filters alone give, as a ratio."""
    own, each = (np.abs(np.diff(x, order, axis=0)) / H**order for x in (output, alone))
    return (own / np.maximum(limit, each.max(axis=1))).max()


@examples(30)
@given(names, names, seeds, st.floats(0.0, 1.0), st.sampled_from([1.0, 1.0, 0.8, 0.5]))
def test_fade_in_a_motion_keeps_the_limits_and_reaches_the_target(first, then, seed, when, share):
    random = np.random.default_rng(seed)
    reference = double_s(random.uniform(-1, 1, 3) * random.uniform(0.05, 3.0), share)
    switch = int(when * (len(reference) - 250))
    old, new = a_filter(random, first), a_filter(random, then)
    output, shares, alone = run(reference, old, new, switch)
    assert excess(output, alone, 2, ACCELERATION) < 1.0 + TOLERANCE
    assert excess(output, alone, 1, VELOCITY) < 1.0 + 1e-6
    np.testing.assert_array_equal(output[-1], reference[-1])
    assert shares[-1] == 1.0
    assert (np.diff(shares) >= 0.0).all()
    # A straight line stays one.
    way = reference[-1]
    along = output @ way / (way @ way)
    np.testing.assert_allclose(output, along[:, None] * way, atol=1e-9)


def stream(random, joints, ticks):
    """Joints that go to ever new velocities, each at its own times and at its limits, shape (ticks, joints) [rad]."""
    velocity, window = np.zeros((ticks, joints)), round(2.0 * ACCELERATION / JERK / H)
    for joint in range(joints):
        now, wanted, until = 0.0, 0.0, 0
        for tick in range(ticks):
            if tick >= until:
                wanted = random.choice([VELOCITY, -VELOCITY, 0.0, random.uniform(-VELOCITY, VELOCITY)])
                until = tick + random.integers(25, 750)
            now += np.clip(wanted - now, -ACCELERATION * H, ACCELERATION * H)
            velocity[tick, joint] = now
    ramps = np.concatenate([np.zeros((window - 1, joints)), velocity])
    smooth = np.lib.stride_tricks.sliding_window_view(ramps, window, axis=0).mean(axis=-1)
    return np.cumsum(smooth, axis=0) * H


@examples(25)
@given(names, names, seeds, st.integers(1, 6))
def test_fade_in_a_stream_of_independent_joints_keeps_the_limits(first, then, seed, joints):
    random = np.random.default_rng(seed)
    reference = stream(random, joints, 1500)
    old, new = a_filter(random, first, joints), a_filter(random, then, joints)
    switch = int(random.integers(50, 600))
    output, shares, alone = run(reference, old, new, switch)
    assert excess(output, alone, 2, ACCELERATION) < 1.0 + STREAMED
    assert excess(output, alone, 1, VELOCITY) < 1.0 + STREAMED
    assert (np.diff(shares) >= 0.0).all()


@examples(30)
@given(names, names, seeds)
def test_output_is_between_both_filters_for_any_reference(first, then, seed):
    random = np.random.default_rng(seed)
    reference = np.cumsum(random.normal(size=(300, 3)), axis=0) * random.choice([1e-4, 1e-2, 1.0])
    output, shares, alone = run(reference, a_filter(random, first), a_filter(random, then), 100)
    assert np.isfinite(output).all()
    assert (output >= alone.min(axis=1) - 1e-9).all()
    assert (output <= alone.max(axis=1) + 1e-9).all()
    assert ((shares >= 0.0) & (shares <= 1.0)).all()


def test_only_fades_to_longer_delays_finish_in_a_cruise_at_the_limit():
    reference = double_s([3.0])
    cruise = slice(500, 1000)
    names = [("none", "zv"), ("zv", "none")]
    shares = []
    for pair in names:
        old, new = (TvistFilter(shaper(name), Fixed([7.0], [0.1]), joints=1) for name in pair)
        output, share, alone = run(reference, old, new, cruise.start)
        assert excess(output, alone, 2, ACCELERATION) < 1.0 + TOLERANCE
        shares.append(share[cruise.stop])
    assert shares[0] > 0.9
    assert shares[1] < 1e-3


def test_fade_never_turns_a_joint_back():
    reference = double_s([1.0])
    old, new = (TvistFilter(shaper(name), Fixed([7.0], [0.1]), joints=1) for name in ("none", "ei3"))
    for switch in range(0, len(reference) - 250, 40):
        output, _, _ = run(reference, old, new, switch)
        assert np.diff(output, axis=0).min() > -1e-8
        old.reset([0.0])


def test_fade_starts_as_the_old_filter_and_ends_as_the_new_one():
    random = np.random.default_rng(0)
    reference = double_s([0.5, -0.8, 0.3], 0.5)
    old, new = a_filter(random, "zv"), a_filter(random, "ei")
    old_alone, new_alone = old.replace(), None
    output, shares, _ = run(reference, old, new, 200)
    begun, over = np.argmax(shares > 0.0), np.argmax(shares == 1.0)
    assert 200 < begun < over < len(reference) - 250
    for tick, (x, shaped) in enumerate(zip(reference, output, strict=True)):
        own = old_alone.filter(x)
        if tick == 199:
            new_alone = a_filter(random, "ei").replace(estimator=new.estimator)
            new_alone.take_over(old_alone)
        elif tick > 199:
            other = new_alone.filter(x)
        if tick < begun:
            np.testing.assert_array_equal(shaped, own)
        if tick >= over:
            np.testing.assert_array_equal(shaped, other)


def test_fade_at_rest_finishes_at_once_without_motion():
    old = TvistFilter(shaper("ei3"), Fixed([7.0], [0.1]), joints=2)
    old.reset([1.0, 2.0])
    fading = fade(old, TvistFilter(shaper("zv"), VARYING, joints=2))
    for _ in range(3):
        assert not fading.finished
        np.testing.assert_array_equal(fading.filter([1.0, 2.0]), [1.0, 2.0])
    assert fading.finished


def test_filter_that_takes_over_continues_the_history():
    reference = double_s([1.0, -0.5], 0.7)[:400]
    for capacity in (1.0, 0.5, 2.0):
        there, other = (
            TvistFilter(shaper(name), Fixed([7.0], [0.1]), joints=2, max_delay=max_delay)
            for name, max_delay in (("ei2", capacity), ("zv", 1.0))
        )
        for x in reference:
            there.filter(x)
            other.filter(x)
        late = TvistFilter(shaper("ei2"), Fixed([7.0], [0.1]), joints=2, max_delay=capacity)
        late.take_over(other)
        for x in reference[::-1]:
            np.testing.assert_array_equal(late.filter(x), there.filter(x))


def test_incompatible_filters_are_refused():
    one, two = (TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), joints=joints) for joints in (1, 2))
    with pytest.raises(ShapingError, match="joints is 1: must be 2"):
        fade(one, two)
    slow = TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), joints=1, period=0.004)
    with pytest.raises(FilterError, match="period"):
        fade(one, slow)
