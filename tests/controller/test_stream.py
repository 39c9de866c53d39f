"""Streams of set-points."""

import numpy as np
import pytest

from tvist_controller.trajectory import MotionLimits, SetpointStream

from .robots import PAPER, ROUNDING, H
from .streams import assert_within, network, peaks, there_and_back

SLOW = 0.008
WIDE = MotionLimits(3.0, 40.0, 2000.0)


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
    """Begins like t⁴ and goes on with at most 2 A ω² = 1.6 rad/s² and 3 A ω³ = 4.8 rad/s³."""
    return 0.5 * amplitude * (1.0 - np.cos(omega * time)) ** 2


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


@pytest.mark.parametrize("first", [40, 2**63 - 200, 2**64 - 500])
def test_a_stream_may_begin_with_any_number(first):
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


def test_one_that_comes_a_tick_late_is_waited_for_from_then_on_and_forgotten_after_a_while():
    """It is made up of the parabola through those before it, and counted; a set-point a tick late finds its place."""
    arrivals = regular(gentle, 1500)
    for late in range(200, 501, 30):
        arrivals[late + 1] = [*arrivals[late + 1], *arrivals.pop(late)]
    stream = start()
    out = play(stream, arrivals, 1500)[:, 0]
    wanted = gentle(np.arange(1500) * H)
    assert (out[:200] == wanted[:200]).all()
    assert out[200] == pytest.approx(wanted[200], abs=4.8 * H**3)
    assert (out[480:500] == wanted[479:499]).all(), "one tick of delay"
    assert (out[-500:] == wanted[-500:]).all(), "and none again"
    assert 1 <= stream.late <= 6, "until it has slowed down enough"
    assert stream.lost == 0


def test_duplicates_and_latecomers_are_dropped_and_counted():
    arrivals = regular(gentle, 300)
    arrivals[100] += [(100, 1.0), (100, 1.0), (50, 1.0)]
    stream = start()
    out = play(stream, arrivals, 300)[:, 0]
    assert (out == gentle(np.arange(300) * H)).all()
    assert (stream.late, stream.lost) == (3, 0)
    assert not stream.offer(3, np.zeros(1))


def test_a_gap_is_bridged_by_the_parabola_and_counted():
    arrivals = regular(lambda t: 0.5 * np.maximum(t - 0.02, 0.0) ** 2, 300)
    del arrivals[150]
    stream = start(limits=MotionLimits(1.5, 2.0, 2000.0))
    out = play(stream, arrivals, 300)[:, 0]
    assert out == pytest.approx(0.5 * np.maximum(np.arange(300) * H - 0.02, 0.0) ** 2, abs=1e-12)
    assert (stream.late, stream.lost) == (0, 1)


def test_a_break_brings_it_to_rest_inside_the_limits_and_it_catches_up_afterwards():
    arrivals = {k: v for k, v in regular(gentle, 4000).items() if not 400 <= k < 900}
    stream = start()
    out = play(stream, arrivals, 4000)[:, 0]
    wanted = gentle(np.arange(4000) * H)
    assert np.ptp(out[890:900]) < 1e-12
    assert (out[-100:] == wanted[-100:]).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert stream.lost == 500
    assert stream.limited > 0


def test_a_burst_after_a_break_is_admitted_whole_and_nothing_is_lost():
    arrivals = regular(gentle, 3000)
    arrivals[450] = [entry for k in range(400, 451) for entry in arrivals.pop(k)]
    stream = start()
    out = play(stream, arrivals, 3000)[:, 0]
    assert (out[2900:] == gentle(np.arange(2900, 3000) * H)).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert (stream.late, stream.lost) == (2, 0), "two were made up before it rested"


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
    assert_within(out)
    assert (out[-500:] == 0.5).all()
    assert stream.limited > 0


@pytest.mark.parametrize("jerk", [0.1, 100.0])
def test_coming_to_rest_is_no_journey_however_low_the_jerk_limit(jerk):
    """A stream may have any acceleration; taking 40 rad/s² back at 0.1 rad/s³ would last 400 s."""
    stream = start(limits=MotionLimits(3.0, 40.0, jerk))
    play(stream, regular(lambda t: 0.5 * 39.0 * t * t, 20), 20)
    out = play(stream, {}, 2000, first=20)
    assert np.ptp(out[-100:]) < 1e-12
    v, a, ramp = 39.0 * 20 * H, 40.0, 0.02
    assert abs(out[-1] - out[0]) < (v + a * ramp) ** 2 / (2 * a) + 2 * (v + a * ramp) * ramp


def test_a_set_point_a_tick_late_for_ever_is_played_a_tick_later():
    """The first ones came early, or the sender's clock is slower: one is made up, then the delay is there."""
    arrivals = {k + (k > 100): [(k, gentle(k * H))] for k in range(1000)}
    stream = start()
    out = play(stream, arrivals, 1000)[:, 0]
    wanted = gentle(np.arange(1000) * H)
    assert (out[:101] == wanted[:101]).all()
    assert (out[300:] == wanted[299:-1]).all()
    assert jumps(out) <= 1.1 * 1.6
    assert stream.lost == 0


# ---------------------------------------------------------------- slower ones


def delay(period):
    """B-spline and spare, two periods and one, of a stream that is in time; a tick less, as it is known at once."""
    return 3 * period - H


def delayed(ticks, function, period=SLOW):
    return function(np.maximum(np.arange(ticks) * H - delay(period), 0.0))


@pytest.mark.parametrize("period", [0.003, 0.004, SLOW, 0.02, 0.05])
def test_slower_streams_come_out_three_periods_late(period):
    """The B-spline runs at q̈ T²/6 beside the set-points."""
    stream = start(period)
    out = play(stream, network(lambda t: gentle(t)[:, None], period, 4.0), 2000)[:, 0]
    # Where the period is no whole number of ticks, some set-points are seen a part of a tick late.
    assert 0.0 <= stream.delay - delay(period) + 1e-12 < H
    error = np.abs(out - gentle(np.maximum(np.arange(2000) * H - stream.delay, 0.0))).max()
    assert error <= 1.6 * period**2 / 6 * 1.01
    assert error > 1.6 * period**2 / 6 * 0.9
    assert stream.lost == stream.late == stream.limited == 0


def test_parabolas_come_out_exactly_beside_themselves():
    def parabola(time):
        return 0.3 + 0.1 * time - 0.4 * time**2

    stream = start(SLOW, WIDE, q=(0.3,))
    out = play(stream, regular(parabola, 300, every=4), 1200)[:, 0]
    wanted = parabola(np.arange(1200) * H - delay(SLOW)) - 0.8 * SLOW**2 / 6
    assert out[-100:] == pytest.approx(wanted[-100:], abs=1e-13)


@pytest.mark.parametrize("period", [0.004, SLOW, 0.02, 0.05])
def test_a_stream_at_the_limits_comes_out_within_them_and_is_never_limited(period):
    """Made by the double-S at the very limits of the stream: second and third differences are means of theirs."""
    motion = there_and_back(PAPER)
    stream = start(period, q=motion(np.zeros(1))[0])
    out = play(stream, network(motion, period, 5.0), 2500)
    assert stream.limited == 0
    assert peaks(out, PAPER).max() <= 1.0 + 2e-6
    assert np.abs(out - delayed(2500, motion, period)).max() <= PAPER.acceleration * period**2 / 6 * 1.01


def test_the_delay_holds_still_for_a_tick_of_jitter():
    """A set-point seen a tick later than most leaves room: the spare period."""
    arrivals = {tick + (tick // 4) % 2: value for tick, value in regular(gentle, 200, every=4).items()}
    stream = start(SLOW)
    out = play(stream, arrivals, 800)[:, 0]
    wanted = gentle(np.maximum(np.arange(800) * H - delay(SLOW) - H, 0.0))
    assert out == pytest.approx(wanted, abs=1.6 * SLOW**2 / 6 * 1.01 + 2e-5)
    assert stream.late == stream.lost == stream.limited == 0


@pytest.mark.parametrize("pause", [0.1, 0.2, 0.8])
@pytest.mark.parametrize("period", [H, SLOW])
def test_a_sender_that_pauses_is_waited_for_and_goes_on_from_there(period, pause):
    """It comes to rest inside the limits, and nothing that comes afterwards is lost."""
    every, gap = round(period / H), round(pause / H)
    count = round(0.8 / period)
    arrivals = regular(gentle, count, every=every)
    more = round(3.0 / period)
    for k in range(count, count + more):
        arrivals[gap + every * k] = [(k, gentle(period * k))]
    stream = start(period)
    out = play(stream, arrivals, every * (count + more) + gap)
    assert_within(out)
    assert (stream.late, stream.lost) == (0, 0)
    ticks = every * (count + more)
    wanted = gentle(np.arange(ticks) * H - (delay(period) if every > 1 else 0.0))
    assert out[-200:, 0] == pytest.approx(wanted[-200:], abs=1.6 * SLOW**2 / 6 * 1.01)


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
    ahead = play(stream, regular(gentle, 3, every=4, first=400) | {}, 1, first=400)  # smooth: it goes on so
    assert ahead[0] == pytest.approx(q + H * qd + 0.5 * H**2 * qdd, abs=100 * H**3)
