"""Streams of set-points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tvist_server.trajectory import Limits, SetpointStream

from .robots import PAPER, ROUNDING, H

SLOW = 0.008
WIDE = Limits(3.0, 40.0, 2000.0)


def play(stream, arrivals, ticks, *, first=0):
    """References of `ticks` ticks; `arrivals` are set-points by the tick before which they come."""
    out = []
    for tick in range(first, first + ticks):
        for sequence, q in arrivals.get(tick, ()):
            stream.offer(sequence, np.atleast_1d(np.array(q, dtype=float)))
        out.append(stream.next())
    return np.array(out)


def regular(function, count, *, every=1, first=0):
    """A set-point at every so many ticks, made of the time of its number."""
    return {first + every * k: [(k, function((every * H) * k))] for k in range(count)}


def start(period=H, limits=PAPER, q=(0.0,)):
    return SetpointStream(np.array(q, dtype=float), period, limits, H)


def gentle(time, amplitude=0.2, omega=2.0):
    """Begins and goes on with at most A ω² = 0.8 rad/s²."""
    return amplitude * (1.0 - np.cos(omega * time))


def jumps(out):
    return np.abs(np.diff(out, 2, axis=0)).max() / H**2


# ---------------------------------------------------------------- at the controller's rate


def test_at_500_hz_the_reference_is_the_set_points_to_the_bit():
    stream = start(q=(0.0, 1.0))
    wanted = np.stack([gentle(np.arange(3000) * H), np.ones(3000)], axis=1)
    out = play(stream, {k: [(k, q)] for k, q in enumerate(wanted)}, 3000)
    assert (out == wanted).all()
    assert (stream.late, stream.lost, stream.limited) == (0, 0, 0)
    assert stream.sequence == 2999


def test_before_the_first_set_point_it_rests_and_tells_no_sequence():
    stream = start(q=(0.7,))
    assert (play(stream, {}, 50) == 0.7).all()
    assert stream.sequence is None


def test_a_stream_may_begin_with_any_number():
    out = play(start(), {k: [(40 + k, gentle(k * H))] for k in range(500)}, 500)
    assert (out[:, 0] == gentle(np.arange(500) * H)).all()


@pytest.mark.parametrize("first", [2**63 - 200, 2**64 - 500])
def test_huge_numbers_are_as_good_as_small_ones(first):
    stream = start()
    out = play(stream, {k: [(first + k, gentle(k * H))] for k in range(500)}, 500)
    assert (out[:, 0] == gentle(np.arange(500) * H)).all()
    assert stream.sequence == first + 499


@pytest.mark.parametrize("leap", [2**63, 2**64 - 1])
@pytest.mark.parametrize("period", [H, SLOW])
def test_a_leap_of_the_number_is_survived_and_counted_with_measure(leap, period):
    every = round(period / H)
    arrivals = regular(gentle, 100, every=every)
    arrivals[100 * every] = [(leap, gentle(period * 100))]
    stream = start(period)
    out = play(stream, arrivals, 100 * every + 1500)
    assert np.isfinite(out).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert out[-1] == pytest.approx(out[-2], abs=1e-12)
    assert stream.sequence == leap
    assert stream.lost == SetpointStream.MAX_WAITING


def test_two_that_change_places_within_a_tick_are_played_in_order():
    arrivals = regular(gentle, 500)
    arrivals[200] = []
    arrivals[201] = [(201, gentle(201 * H)), (200, gentle(200 * H))]
    stream = start()
    out = play(stream, arrivals, 500)[:, 0]
    wanted = gentle(np.arange(500) * H)
    assert (np.delete(out, 200) == np.delete(wanted, 200)).all()
    assert out[200] == pytest.approx(wanted[200], abs=2e-8)  # bridged: third difference, A ω³ h³ = 1.3e-8
    assert (stream.late, stream.lost) == (0, 0)


def test_duplicates_and_latecomers_are_dropped_and_counted():
    arrivals = regular(gentle, 300)
    arrivals[100] += [(100, 1.0), (100, 1.0), (50, 1.0)]
    stream = start()
    out = play(stream, arrivals, 300)[:, 0]
    assert (out == gentle(np.arange(300) * H)).all()
    assert (stream.late, stream.lost) == (3, 0)
    assert not stream.offer(3, np.zeros(1))


def test_a_gap_is_bridged_by_the_parabola_and_counted():
    arrivals = regular(lambda t: 0.5 * t * t, 300)  # 1 rad/s²: the parabola is exact
    del arrivals[150]
    stream = start()
    out = play(stream, arrivals, 300)[:, 0]
    assert out == pytest.approx(0.5 * (np.arange(300) * H) ** 2, abs=1e-12)
    assert (stream.late, stream.lost) == (0, 1)


def test_a_break_brings_it_to_rest_inside_the_limits_and_it_catches_up_afterwards():
    arrivals = {k: v for k, v in regular(gentle, 2000).items() if not 400 <= k < 900}
    stream = start()
    out = play(stream, arrivals, 2000)[:, 0]
    wanted = gentle(np.arange(2000) * H)
    assert np.ptp(out[890:900]) < 1e-12
    assert (out[1700:] == wanted[1700:]).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert stream.lost == 500
    assert stream.limited > 0


def test_a_burst_after_a_break_is_admitted_whole_and_nothing_is_lost():
    arrivals = regular(gentle, 1000)
    arrivals[450] = [entry for k in range(400, 451) for entry in arrivals.pop(k)]
    stream = start()
    out = play(stream, arrivals, 1000)[:, 0]
    assert (out[900:] == gentle(np.arange(900, 1000) * H)).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert (stream.late, stream.lost) == (0, 0)


def test_room_to_wait_is_limited():
    stream = start()
    taken = [stream.offer(k, np.zeros(1)) for k in range(SetpointStream.MAX_WAITING + 5)]
    assert sum(taken) == SetpointStream.MAX_WAITING
    assert stream.late == 5
    stream.next()
    assert stream.offer(10**6, np.zeros(1))


@pytest.mark.parametrize("period", [H, SLOW, 0.1])
def test_a_step_of_half_a_radian_stays_within_the_limits(period):
    every = round(period / H)
    arrivals = regular(lambda t: 0.5 * (t > 0.19), 3000 // every, every=every)
    stream = start(period)
    out = play(stream, arrivals, 3000)
    velocity = np.abs(np.diff(out, axis=0)).max() / H
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert velocity <= PAPER.velocity + PAPER.acceleration**2 / (2 * PAPER.jerk) + PAPER.acceleration * H
    assert (out[-500:] == 0.5).all()
    assert stream.limited > 0


@pytest.mark.parametrize("jerk", [0.1, 100.0])
def test_coming_to_rest_is_no_journey_however_low_the_jerk_limit(jerk):
    """A stream may have any acceleration; taking 40 rad/s² back at 0.1 rad/s³ would last 400 s."""
    stream = start(limits=Limits(3.0, 40.0, jerk))
    play(stream, regular(lambda t: 0.5 * 39.0 * t * t, 20), 20)
    out = play(stream, {}, 2000, first=20)
    assert np.ptp(out[-100:]) < 1e-12
    v, a, ramp = 39.0 * 20 * H, 40.0, 0.02
    assert abs(out[-1] - out[0]) < (v + a * ramp) ** 2 / (2 * a) + 2 * (v + a * ramp) * ramp


def test_a_set_point_a_tick_late_for_ever_is_followed_nearly_as_well():
    """The first one came early, or the sender's clock is slower: it is bridged, not stopped."""
    arrivals = {k + (k > 100): [(k, gentle(k * H))] for k in range(1000)}
    stream = start()
    out = play(stream, arrivals, 1000)[:, 0]
    assert out == pytest.approx(gentle(np.arange(1000) * H), abs=2e-8)
    assert (stream.late, stream.lost) == (0, 0)


# ---------------------------------------------------------------- slower ones


def late_by_a_period(ticks, function, period=SLOW):
    return function(np.maximum(np.arange(ticks) * H - period, 0.0))


@pytest.mark.parametrize("period", [0.004, SLOW, 0.02, 0.1])
def test_slower_streams_come_out_one_period_late(period):
    """At a set-point's own time plus a period the reference is that set-point, to the bit."""
    every = round(period / H)
    stream = start(period, WIDE)
    out = play(stream, regular(gentle, 60, every=every), 60 * every)[:, 0]
    assert (out[every::every] == gentle(period * np.arange(59))).all()
    assert stream.lost == stream.late == stream.limited == 0


def test_parabolas_are_exact():
    def parabola(time):
        return 0.3 + 0.1 * time - 0.4 * time**2

    stream = start(SLOW, WIDE, q=(0.3,))
    out = play(stream, regular(parabola, 100, every=4), 400)[:, 0]
    wanted = parabola(np.arange(400) * H - SLOW)
    assert out[30:] == pytest.approx(wanted[30:], abs=1e-13)


@pytest.mark.parametrize("omega", [2.0, 2 * np.pi])
def test_the_error_on_a_sine_is_what_hermite_interpolation_allows(omega):
    """|e| ≤ T/4·T²/3·max|q⃛| + T⁴/384·max|q⁗|: the error of the slopes T²/3 q⃛, and that of the cubic."""
    amplitude = 0.1
    stream = start(SLOW, WIDE)
    out = play(stream, regular(lambda t: gentle(t, amplitude, omega), 400, every=4), 1600)[:, 0]
    error = np.abs(out - late_by_a_period(1600, lambda t: gentle(t, amplitude, omega)))[40:].max()
    third, fourth = amplitude * omega**3, amplitude * omega**4
    assert error <= SLOW**3 / 12 * third + SLOW**4 / 384 * fourth
    assert error > SLOW**3 / 200 * third


def test_velocity_does_not_step_from_one_set_point_to_the_next():
    """A step of velocity Δ would be a second difference Δ/h, 500 Δ. Here it is the sine's own and some jerk."""
    stream = start(SLOW, WIDE)
    omega, amplitude = 2 * np.pi, 0.1
    out = play(stream, regular(lambda t: gentle(t, amplitude, omega), 400, every=4), 1600)
    assert jumps(out[40:]) <= amplitude * omega**2 + 4 * SLOW * amplitude * omega**3


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), period=st.sampled_from([H, 0.003, SLOW, 0.05]))
def test_whatever_comes_stays_finite_and_inside_the_limits(seed, period):
    """Loss, jitter, duplicates, leaps and noise."""
    random = np.random.default_rng(seed)
    every, arrivals = period / H, {}
    sequence = 0
    for k in range(int(600 / every)):
        sequence += int(random.choice([1, 1, 1, 1, 1, 1, 1, 2, 7, 100, 2**40]))
        if random.random() < 0.1:
            continue
        tick = int(k * every + random.exponential(every))
        q = np.clip(gentle(k * period) + random.choice([0, 0, 0, 1]) * random.normal(0, 0.3), -6, 6)
        arrivals.setdefault(tick, []).extend([(sequence, q)] * int(random.choice([1, 1, 1, 3])))
    stream = start(period)
    out = play(stream, arrivals, 600)
    velocity = np.abs(np.diff(out, axis=0)).max() / H
    assert np.isfinite(out).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert velocity <= PAPER.velocity + PAPER.acceleration**2 / (2 * PAPER.jerk) + PAPER.acceleration * H
    assert stream.late >= 0
    assert stream.lost >= 0


def test_a_set_point_a_tick_late_does_not_show():
    """Exactly one period late leaves a tick of room."""
    arrivals = {tick + (tick // 4) % 2: value for tick, value in regular(gentle, 200, every=4).items()}
    jittering = play(start(SLOW, WIDE), arrivals, 800)
    assert (jittering == play(start(SLOW, WIDE), regular(gentle, 200, every=4), 800)).all()


def test_pause_and_resume():
    """A client that pauses holds its set-point; one that goes silent is waited for, and goes on from there."""
    arrivals = regular(gentle, 100, every=4)
    resumed = {400 + 4 * 100 + 4 * k: [(100 + k, gentle(SLOW * (100 + k)))] for k in range(200)}
    stream = start(SLOW)
    out = play(stream, arrivals | resumed, 1600)
    assert np.ptp(out[700:800]) < 1e-12
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert (stream.late, stream.lost) == (0, 0)
    assert out[800 + 4 * 199, 0] == pytest.approx(gentle(SLOW * 298), abs=1e-6)


@pytest.mark.parametrize("period", [H, 0.003, SLOW])
def test_holding_still_for_an_hour_changes_nothing(period):
    """The ticks in between are skipped: numbers and time go on as they would."""
    stream = start(period, q=(0.1, -2.0))
    stream.offer(0, np.array([0.1, -2.0]))
    play(stream, {}, 10)
    stream._ticks += round(3600.0 / H)
    count = int(3600.0 / period)
    for k in range(count, count + 500):
        stream.offer(k, np.array([0.1, -2.0]))
        assert (stream.next() == [0.1, -2.0]).all()
    assert stream.lost <= SetpointStream.MAX_WAITING + 2


def test_it_never_ends_by_itself():
    stream = start()
    play(stream, regular(gentle, 10), 100)
    assert not stream.finished


def test_its_state_is_that_of_its_reference():
    stream = start(SLOW)
    out = play(stream, regular(gentle, 100, every=4), 400)
    q, qd, qdd = stream.state
    assert q == out[-1]
    assert qd == pytest.approx(np.gradient(out[:, 0], H)[-1], abs=2 * PAPER.acceleration * H)
    assert qdd == pytest.approx((out[-1] - 2 * out[-2] + out[-3]) / H**2, abs=1e-9)
