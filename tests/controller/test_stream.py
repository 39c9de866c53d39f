"""Streams of set-points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples
from tests.plant.arms import chain

from tvist_controller.foresight import clearance
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line import differentiator
from tvist_controller.line import limits as line_limits
from tvist_controller.line.differentiator import Target
from tvist_controller.line.limits import TORQUE_SHARE, StreamTorqueMargin
from tvist_controller.line.line_tick import TORQUE
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import JointStop, MotionLimits, SetpointStream, limiter, stream
from tvist_plant.description import load

from .robots import PAPER, Q1, Q3, ROUNDING, UR5E, H, without_arm
from .streams import assert_within, minimum_jerk, network, peaks, played, swinging, there_and_back

SLOW = 0.008


def regular(function, count, *, every=1, first=0):
    """Return a set-point every few ticks, computed from its time."""
    return {first + every * k: [(k, function((every * H) * k))] for k in range(count)}


def start(period=H, limits=PAPER, q=(0.0,)):
    return SetpointStream(np.array(q, dtype=float), period, limits)


def gentle(time, amplitude=0.2, omega=2.0):
    """Return a motion that begins like t⁴, with at most 2 A ω² = 1.6 rad/s² and 3 A ω³ = 4.8 rad/s³."""
    return 0.5 * amplitude * (1.0 - np.cos(omega * time)) ** 2


def jumps(out):
    return np.abs(np.diff(out, 2, axis=0)).max() / H**2


@pytest.mark.parametrize("first", [0, 2**63 - 200, 2**64 - 3000])
def test_a_500_hz_stream_with_any_sequence_numbers_passes_unchanged(first):
    stream = start(q=(0.0, 1.0))
    wanted = np.stack([gentle(np.arange(3000) * H), np.ones(3000)], axis=1)
    out = played(stream, {k: [(first + k, q)] for k, q in enumerate(wanted)}, 3000)
    assert (out == wanted).all()
    assert (stream.late, stream.lost, stream.limited) == (0, 0, 0)
    assert stream.sequence == first + 2999


@pytest.mark.parametrize("leap", [2**63, 2**64 - 1])
@pytest.mark.parametrize("period", [H, SLOW])
def test_a_leap_of_the_sequence_number_keeps_limits(leap, period):
    every = round(period / H)
    arrivals = regular(gentle, 100, every=every)
    arrivals[100 * every] = [(leap, gentle(period * 100))]
    stream = start(period)
    out = played(stream, arrivals, 100 * every + 1500)
    assert np.isfinite(out).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert out[-1] == pytest.approx(out[-2], abs=1e-12)
    assert stream.sequence == leap
    assert stream.lost == SetpointStream.MAX_WAITING


def test_the_delay_adapts_to_late_set_points_and_back():
    """Missing points are extrapolated and counted; a point one tick late is used."""
    arrivals = regular(gentle, 1500)
    for late in range(200, 501, 30):
        arrivals[late + 1] = [*arrivals[late + 1], *arrivals.pop(late)]
    stream = start()
    out = played(stream, arrivals, 1500)[:, 0]
    wanted = gentle(np.arange(1500) * H)
    assert (out[:200] == wanted[:200]).all()
    assert out[200] == pytest.approx(wanted[200], abs=4.8 * H**3)
    assert (out[480:500] == wanted[479:499]).all(), "one tick of delay"
    assert (out[-500:] == wanted[-500:]).all(), "and none again"
    assert 1 <= stream.late <= 6, "until it has slowed down enough"
    assert stream.lost == 0


def test_duplicate_and_late_set_points_are_dropped_and_counted():
    arrivals = regular(gentle, 300)
    arrivals[100] += [(100, 1.0), (100, 1.0), (50, 1.0)]
    stream = start()
    out = played(stream, arrivals, 300)[:, 0]
    assert (out == gentle(np.arange(300) * H)).all()
    assert (stream.late, stream.lost) == (3, 0)
    assert not stream.offer(3, np.zeros(1))


def test_a_missing_set_point_is_extrapolated_and_counted():
    arrivals = regular(lambda t: 0.5 * np.maximum(t - 0.02, 0.0) ** 2, 300)
    del arrivals[150]
    stream = start(limits=MotionLimits(1.5, 2.0, 2000.0))
    out = played(stream, arrivals, 300)[:, 0]
    assert out == pytest.approx(0.5 * np.maximum(np.arange(300) * H - 0.02, 0.0) ** 2, abs=1e-12)
    assert (stream.late, stream.lost) == (0, 1)


def test_a_burst_after_a_break_is_accepted_without_loss():
    arrivals = regular(gentle, 3000)
    arrivals[450] = [entry for k in range(400, 451) for entry in arrivals.pop(k)]
    stream = start()
    out = played(stream, arrivals, 3000)[:, 0]
    assert (out[2900:] == gentle(np.arange(2900, 3000) * H)).all()
    assert jumps(out) <= PAPER.acceleration * (1 + 1e-5) + ROUNDING
    assert (stream.late, stream.lost) == (2, 0), "two were made up before it rested"


@pytest.mark.parametrize("period", [H, SLOW, 0.1])
def test_a_step_of_half_a_radian_stays_within_the_limits(period):
    every = round(period / H)
    arrivals = regular(lambda t: 0.5 * (t > 0.19), 3000 // every, every=every)
    stream = start(period)
    out = played(stream, arrivals, 3000)
    assert_within(out)
    assert (out[-500:] == 0.5).all()
    assert stream.limited > 0


@pytest.mark.parametrize("jerk", [0.1, 100.0])
def test_a_silent_stream_rests_soon_even_with_a_low_jerk_limit(jerk):
    """A stream may have any acceleration; taking 40 rad/s² back at 0.1 rad/s³ would last 400 s."""
    stream = start(limits=MotionLimits(3.0, 40.0, jerk))
    played(stream, regular(lambda t: 0.5 * 39.0 * t * t, 20), 20)
    out = played(stream, {}, 2000)
    assert np.ptp(out[-100:]) < 1e-12
    v, a, ramp = 39.0 * 20 * H, 40.0, 0.02
    assert abs(out[-1] - out[0]) < (v + a * ramp) ** 2 / (2 * a) + 2 * (v + a * ramp) * ramp


def delay(period):
    """Return a timely stream's delay: three periods (B-spline and spare), less a tick."""
    return 3 * period - H


@pytest.mark.parametrize("period", [0.003, 0.004, SLOW, 0.02, 0.05])
def test_slower_streams_are_delayed_by_three_periods(period):
    """The B-spline deviates from the set-points by q̈ T²/6."""
    stream = start(period)
    out = played(stream, network(lambda t: gentle(t)[:, None], period, 4.0), 2000)[:, 0]
    # Where the period is no whole number of ticks, some set-points are seen a part of a tick late.
    assert 0.0 <= stream.delay - delay(period) + 1e-12 < H
    error = np.abs(out - gentle(np.maximum(np.arange(2000) * H - stream.delay, 0.0))).max()
    assert error <= 1.6 * period**2 / 6 * 1.01
    assert error > 1.6 * period**2 / 6 * 0.9
    assert stream.lost == stream.late == stream.limited == 0


@pytest.mark.parametrize("period", [0.004, SLOW, 0.02, 0.05])
def test_a_stream_at_its_limits_passes_without_limitation(period):
    """The double-S is at the limits: its differences are means of its derivatives."""
    motion = there_and_back(PAPER)
    stream = start(period, q=motion(np.zeros(1))[0])
    out = played(stream, network(motion, period, 5.0), 2500)
    assert stream.limited == 0
    assert peaks(out, PAPER).max() <= 1.0 + 2e-6
    wanted = motion(np.maximum(np.arange(2500) * H - delay(period), 0.0))
    assert np.abs(out - wanted).max() <= PAPER.acceleration * period**2 / 6 * 1.01


@pytest.mark.parametrize("pause", [0.1, 0.2, 0.8])
@pytest.mark.parametrize("period", [H, SLOW])
def test_a_stream_continues_after_a_pause_of_its_sender(period, pause):
    """It rests within the limits, and no later set-point is lost."""
    every, gap = round(period / H), round(pause / H)
    count = round(0.8 / period)
    arrivals = regular(gentle, count, every=every)
    more = round(3.0 / period)
    for k in range(count, count + more):
        arrivals[gap + every * k] = [(k, gentle(period * k))]
    stream = start(period)
    out = played(stream, arrivals, every * (count + more) + gap)
    assert_within(out)
    assert (stream.late, stream.lost) == (0, 0)
    ticks = every * (count + more)
    wanted = gentle(np.arange(ticks) * H - (delay(period) if every > 1 else 0.0))
    assert out[-200:, 0] == pytest.approx(wanted[-200:], abs=1.6 * SLOW**2 / 6 * 1.01)


DYNAMICS = InverseDynamics(UR5E, body(paper_payload(UR5E)))
MOST = np.array(UR5E.limits.torque)


@pytest.mark.parametrize("frequency", [1.5, 3.0])
@pytest.mark.parametrize("start", [Q1, Q3])
def test_a_shaped_stream_keeps_its_torque_share(start, frequency):
    """Two per thousand are for the difference between a reference and its shaped one."""
    line = without_arm(q=start)
    stream = line.stream(H, MotionLimits(3.0, 40.0, 2000.0))
    motion = swinging([0.05, 0.1, 0.1, 0.1, 0.1, 0.1], frequency, 0.4)
    samples = []
    for k, q in enumerate(motion(np.arange(900) * H)):
        stream.offer(k, start + q)
        samples.append(line.step())
    shares = np.abs([sample.signals[TORQUE] for sample in samples]) / MOST
    assert shares.max() <= TORQUE_SHARE * 1.002
    asked = np.array([start + q for q in motion(np.arange(900) * H)])
    needed = [
        np.abs(DYNAMICS.torque(b, (c - a) / (2 * H), (c - 2 * b + a) / H**2) / MOST).max()
        for a, b, c in zip(asked, asked[1:], asked[2:], strict=False)
    ]
    assert (stream.limited > 0) == (max(needed) > TORQUE_SHARE)


TICKS = 2000
NEARLY = MotionLimits(0.95 * PAPER.velocity, 0.95 * PAPER.acceleration, 0.95 * PAPER.jerk)
MOTIONS = {
    "double-S": there_and_back(NEARLY),
    "sine": swinging([0.07, -0.05, 0.03]),
    "minimum jerk": minimum_jerk([1.2, -0.8]),
}


def follow(motion, period, **network_):
    stream = start(period, q=motion(np.zeros(1))[0])
    return stream, played(stream, network(motion, period, TICKS * H, **network_), TICKS)


def from_clean(out, clean):
    """Return the largest distance from a clean stream, whatever its lag [rad]."""
    ticks = np.arange(len(out))
    columns = list(zip(out.T, clean.T, strict=True))
    return min(
        max(np.abs(one - np.interp(ticks - lag, ticks, other)).max() for one, other in columns)
        for lag in np.arange(-10.0, 30.0, 0.25)
    )


@pytest.mark.parametrize("name", MOTIONS)
def test_jitter_and_loss_at_125_hz_change_the_stream_by_under_two_mrad(name):
    _, clean = follow(MOTIONS[name], 0.008)
    for seed in range(3):
        stream, out = follow(MOTIONS[name], 0.008, seed=seed, jitter=1.0, loss=0.05, twice=0.03)
        assert_within(out)
        assert from_clean(out, clean) <= 2e-3
        assert stream.lost > 0
        assert stream.late > 0


@pytest.mark.parametrize("clock", [-0.005, 0.005])
@pytest.mark.parametrize("period", [H, 0.008, 0.02])
def test_a_sender_clock_off_by_half_a_percent_is_followed(period, clock):
    """The delay follows smoothly; at 500 Hz most points of a slow clock are extrapolated."""
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
def test_random_streams_stay_finite_in_range_and_within_limits(seed, period, limits, jitter, wildness):
    random = np.random.default_rng(seed)
    reach = np.full(2, 6.3)
    swing = swinging([0.3, -0.2], 1.0, 0.3)

    def motion(times):
        return np.clip(swing(times) + wildness * random.normal(size=(len(times), 2)), -6.28, 6.28)

    arrivals = network(
        motion, period, 1.0, seed=seed, jitter=jitter, loss=0.2, twice=0.2, burst=random.integers(1, 12)
    )
    stream = SetpointStream(np.zeros(2), period, limits, reach=reach)
    out = played(stream, arrivals, 700)
    velocity, acceleration, jerk = (np.abs(np.diff(out, n, axis=0)).max() / H**n for n in (1, 2, 3))
    assert np.isfinite(out).all()
    assert (np.abs(out) <= reach).all()
    assert velocity <= limits.velocity * (1 + 1e-5) + 2 * limits.acceleration * H
    assert acceleration <= limits.acceleration * (1 + 1e-5) + 1e-8
    assert jerk <= limits.jerk * (1 + 1e-4) + 1e-5


@pytest.mark.parametrize(("period", "share"), [(H, 1.0), (0.003, 0.9), (0.008, 1.6)])
def test_stream_kernels_are_bit_equal_in_python(period, share, monkeypatch):
    """Within its limits, at them and beyond."""
    wanted = there_and_back(
        MotionLimits(share * PAPER.velocity, share * PAPER.acceleration, share * PAPER.jerk)
    )
    arrivals = network(wanted, period, 1.2, seed=3, jitter=1.2, loss=0.02)
    room = StreamTorqueMargin(UR5E, InverseDynamics(UR5E, UR5E.payload))

    def play():
        stream = SetpointStream(np.zeros(6), period, PAPER, reach=np.full(6, 6.28), torque=room)
        return played(stream, arrivals, 600), stream.limited

    compiled, limited = play()
    for module in (clearance, differentiator, limiter, line_limits, stream):
        for name, one in vars(module).copy().items():
            if hasattr(one, "py_func"):
                monkeypatch.setattr(module, name, one.py_func)
    plain, limited_plain = play()
    assert (compiled == plain).all()
    assert limited == limited_plain


@pytest.mark.parametrize(("arm", "beyond"), [("ur5e", 0.0), ("ur5e", 1.0), ("one-joint", 0.0)])
def test_the_torque_margin_kernel_is_bit_equal_to_numpy(arm, beyond):
    description = load(arm)
    dynamics, random = InverseDynamics(description, description.payload), np.random.default_rng(2)
    limit, n = np.array(description.limits.torque), description.joints
    room = StreamTorqueMargin(description, dynamics, beyond)
    for q, qd, qdd in random.uniform(-3, 3, (300, 3, n)):
        still = dynamics.effort(q, qd, np.zeros(n))
        inertia = np.abs(dynamics.inertia(q)).sum(axis=1)
        wanted = ((0.9 * limit - still) / inertia).min()
        if beyond:
            wanted = min(wanted, ((limit - still) / ((1.0 + beyond) * inertia)).min())
        found = room.acceleration(q, qd)
        assert found == max(wanted, 1.0)
        pushed = qdd * found
        fits = (dynamics.effort(q, qd, pushed) <= 0.9 * limit).all()
        if beyond:
            fits &= (dynamics.effort(q, qd, 2.0 * pushed) <= limit).all()
        assert room.allows(q, qd, pushed) == (fits or np.abs(pushed).max() <= 1.0)


@pytest.mark.parametrize("limit", [1.0, 8.0, 40.0])
def test_the_closed_form_stop_matches_ruckig(limit):
    random = np.random.default_rng(int(limit))
    for scale in (1e-3, 1.0):
        qd, qdd = scale * random.uniform(-3, 3, 40), scale * random.uniform(-60, 60, 40)
        qd[:4], qdd[4:8] = 0.0, 0.0
        stop = JointStop(np.zeros(40), qd, qdd, acceleration=limit, jerk=2000.0)
        durations = []
        for j, (v, a) in enumerate(zip(qd.tolist(), qdd.tolist(), strict=True)):
            phases = clearance.stop_phases(v, a, limit, 2000.0)
            durations.append(phases[0] + phases[2] + phases[3])
            for share in (0.0, 0.01, 0.1, 0.4, 0.8, 1.0):
                wanted = [values[j] for values in stop.at(share * stop.duration)]
                found = clearance.after(v, a, phases, share * stop.duration)
                assert found == pytest.approx(wanted, abs=1e-9)
        assert max(durations) == pytest.approx(stop.duration, abs=1e-9)


@pytest.mark.parametrize(
    "arm", [UR5E, load("one-joint"), chain(7)], ids=["ur5e", "one-joint", "seven joints"]
)
def test_a_stop_proved_clear_by_bounds_is_clear(arm):
    random = np.random.default_rng(7)
    model, joints = CollisionModel(arm, arm.payload), arm.joints
    proved = clear = 0
    for _ in range(150):
        q, qd, qdd = random.uniform(-1, 1, (3, joints)) * [[2.0], [2.0], [9.0]]
        state, limit = Target(q, qd, qdd), float(random.choice([2.0, 9.0, 40.0]))
        spacious = model.stop_is_spacious(state, limit, 2000.0)
        stop = JointStop(q, qd, qdd, acceleration=limit, jerk=2000.0)
        free = all(model.meeting(stop.at(time)[0]) is None for time in np.linspace(0.0, stop.duration, 60))
        assert spacious <= free
        turned = np.abs(qd) * stop.duration + 0.01
        if model.is_spacious(q, turned):
            corners = q + random.uniform(-1, 1, (20, joints)) * turned
            assert all(model.meeting(corner) is None for corner in corners)
        proved, clear = proved + spacious, clear + free
    assert proved >= 0.8 * clear > 0
