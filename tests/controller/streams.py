"""Streams of set-points as networks deliver them, and checks of the resulting references."""

import numpy as np

from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion

from .robots import PAPER, ROUNDING, H


def network(motion, period, seconds, *, seed=0, jitter=0.0, loss=0.0, twice=0.0, clock=0.0, burst=1):
    """Return set-points by the tick before which they arrive.

    Args:
        motion: Positions, shape (k, n), by times of shape (k,).
        period: Between set-points, by the sender's clock [s].
        seconds: How long.
        seed: Of chance.
        jitter: Each comes late by a chance share of so many periods, so that they change places.
        loss: Share that never comes.
        twice: Share that comes again a little later.
        clock: How much slower the sender's clock is than ours [-].
        burst: So many are held back and come at once.
    """
    random = np.random.default_rng(seed)
    arrivals = {}
    for k, q in enumerate(motion(period * np.arange(round(seconds / period)))):
        sent = (k // burst + 1) * burst - 1
        time = period * (sent * (1.0 + clock) + jitter * random.random()) - period * (burst - 1)
        tick = max(int(np.ceil(time / H - 1e-9)), 0)
        if random.random() >= loss:
            arrivals.setdefault(tick, []).append((k, q))
            if random.random() < twice:
                arrivals.setdefault(tick + int(random.integers(0, 5)), []).append((k, q))
    return arrivals


def played(stream, arrivals, ticks):
    """Return the references of a number of ticks, shape (ticks, n)."""
    out = []
    for tick in range(ticks):
        for sequence, q in arrivals.get(tick, ()):
            stream.offer(sequence, np.atleast_1d(np.array(q, dtype=float)))
        out.append(stream.next())
    return np.array(out)


def peaks(out, limits):
    """Return the largest first, second and third difference relative to their limits, shape (3,)."""
    orders = enumerate((limits.velocity, limits.acceleration, limits.jerk), 1)
    return np.array([np.abs(np.diff(out, order, axis=0)).max() / H**order / limit for order, limit in orders])


def assert_within(out, limits=PAPER, *, beyond=(1e-5, 1e-4)):
    """Check acceleration and jerk up to rounding, and velocity up to one tick of acceleration."""
    velocity, acceleration, jerk = peaks(out, limits)
    assert np.isfinite(out).all()
    assert velocity <= 1.0 + limits.acceleration * H / limits.velocity
    assert acceleration <= 1.0 + beyond[0] + ROUNDING / limits.acceleration
    assert jerk <= 1.0 + beyond[1] + 10 * ROUNDING / H / limits.jerk


def there_and_back(limits: MotionLimits, way=(1.4, -1.0, 0.8, -0.5, 0.3, 2.0), dwell=0.3):
    """Return positions by time of double-S motions to and fro with rests in between."""
    target, start = np.array(way), np.zeros(len(way))
    go = quickest_motion(JointLine(start, target), limits)
    back = quickest_motion(JointLine(target, start), limits)
    turn, cycle = go.duration + dwell, 2 * (go.duration + dwell)

    def at(time):
        time = max(time, 0.0) % cycle
        motion, since = (go, time) if time < turn else (back, time - turn)
        return motion.law.at(min(since, motion.duration))[0]

    return lambda times: np.array([at(time) for time in times])


def swinging(amplitudes, frequency=0.8, begin=1.5):
    """Return sines that begin without acceleration and jerk."""
    amplitudes = np.array(amplitudes, dtype=float)

    def at(times):
        share = np.clip(times / begin, 0.0, 1.0)
        swell = share**4 * (35 - 84 * share + 70 * share**2 - 20 * share**3)
        return (swell * np.sin(2 * np.pi * frequency * times))[:, None] * amplitudes

    return at


def minimum_jerk(way, duration=2.0):
    """Return a motion from rest to rest along a polynomial of fifth degree."""
    way = np.array(way, dtype=float)

    def at(times):
        share = np.clip(times / duration, 0.0, 1.0)
        return (share**3 * (10 - 15 * share + 6 * share**2))[:, None] * way

    return at
