"""The limiter: inside the limits, and exact again afterwards."""

from itertools import pairwise

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from tvist_server.trajectory import Limits
from tvist_server.trajectory.limiter import Limiter

from .robots import PAPER, ROUNDING, H


def followed(limiter: Limiter, points) -> np.ndarray:
    """What comes out for a walk from rest; with each point goes the slope of the parabola through the last three."""
    out, before, last = [limiter.q], limiter.q, limiter.q
    for point in points:
        rise, fall = point - last, last - before
        out.append(limiter.follow(point, (1.5 * rise - 0.5 * fall) / H))
        before, last = last, point
    return np.array(out)


def assert_within(out: np.ndarray, limits: Limits) -> None:
    """Velocity and acceleration by differences of the positions alone.

    A tick's second difference is a mean of the acceleration around it, so the limit holds to rounding and to the
    limiter's own tolerance. Velocity may exceed its limit by a²/2j: a stream may come to the limit of velocity
    with full acceleration, which can be taken back no faster than the jerk limit allows.
    """
    velocity, acceleration = np.diff(out, axis=0) / H, np.diff(out, 2, axis=0) / H**2
    room = limits.acceleration**2 / (2 * limits.jerk) + limits.acceleration * H
    assert np.isfinite(out).all()
    assert np.abs(acceleration).max(initial=0) <= limits.acceleration * (1 + 2e-6) + ROUNDING
    assert np.abs(velocity).max(initial=0) <= limits.velocity * (1 + 2e-6) + room


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    joints=st.integers(1, 7),
    roughness=st.sampled_from([1e-7, 3e-6, 1e-5, 1e-4, 3e-3, 0.1]),
    limits=st.builds(
        Limits,
        velocity=st.floats(0.1, 3.14),
        acceleration=st.floats(0.5, 40.0),
        jerk=st.floats(400.0, 2000.0),
    ),
)
def test_random_walks_stay_within_the_limits_are_caught_up_with_and_then_equalled(
    seed, joints, roughness, limits
):
    random = np.random.default_rng(seed)
    walk = np.cumsum(np.cumsum(random.normal(0, roughness, (150, joints)), axis=0) / 10, axis=0)
    walk = np.clip(walk, -6.0, 6.0)
    limiter = Limiter(np.zeros(joints), limits, H)
    out = followed(limiter, walk)
    way = np.abs(out[-1] - walk[-1]).max()
    enough = int((way / limits.velocity + 4 * limits.velocity / limits.acceleration + 1.0) / H)
    still = np.zeros(joints)
    held = [limiter.follow(walk[-1], still)]
    while limiter.limited and len(held) < enough:
        held.append(limiter.follow(walk[-1], still))
    held += [limiter.follow(walk[-1], still) for _ in range(10)]
    assert_within(np.array([*out, *held]), limits)
    assert (np.array(held[-10:]) == walk[-1]).all()


def test_a_walk_inside_the_limits_passes_to_the_bit_and_is_never_limited():
    time = np.arange(2000) * H
    walk = np.stack([0.3 * (1 - np.cos(2.0 * time)), 0.1 * np.sin(1.0 * time) ** 3], axis=1)
    limiter = Limiter(walk[0], PAPER, H)
    for before, point in pairwise(walk):
        assert (limiter.follow(point, (point - before) / H) == point).all()
        assert not limiter.limited


@pytest.mark.parametrize("jump", [1e-4, 0.01, 0.2, -0.2])
@pytest.mark.parametrize(
    "motion",
    [
        lambda t: 0.5 * (t - 0.25 * (1 - np.exp(-t / 0.25))),  # ends at 0.5 rad/s
        lambda t: 0.2 * (1 - np.cos(2.5 * t)),  # up to 1.25 rad/s²
    ],
)
def test_after_catching_up_with_what_moves_it_passes_to_the_bit_again(motion, jump):
    """A jump at 1 s is caught up with in about three times the time that it takes at rest."""
    time = np.arange(1500) * H
    walk = np.stack([motion(time) + jump * (time > 1.0), 0.1 * motion(time)], axis=1)
    limiter = Limiter(walk[0], PAPER, H)
    out = followed(limiter, walk[1:])
    assert_within(out, PAPER)
    equal = out == walk
    began = int(1.0 / H) + 1
    caught_up = began + int((0.1 + 6 * np.sqrt(abs(jump) / PAPER.acceleration)) / H)
    assert equal[:began].all()
    assert not equal[began + 1, 0]
    assert equal[caught_up:].all()
    assert equal[:, 1].all(), "the other joint is not held back"


def test_at_the_change_from_catching_up_to_passing_acceleration_does_not_step_beyond_the_limit():
    """The first passed tick is judged by the last displacement, not by ruckig's velocity at its end."""
    random = np.random.default_rng(5)
    worst = 0.0
    for _ in range(40):
        limiter = Limiter(np.zeros(1), PAPER, H)
        jump, speed = random.uniform(1e-5, 0.02), random.uniform(-0.5, 0.5)
        walk = [np.array([jump + speed * H * k]) for k in range(600)]
        out = followed(limiter, walk)
        worst = max(worst, np.abs(np.diff(out, 2, axis=0)).max() / H**2)
    assert worst <= PAPER.acceleration * (1 + 2e-6) + ROUNDING


def test_where_no_catching_up_can_be_computed_it_brakes_inside_the_limits(monkeypatch):
    limiter = Limiter(np.zeros(2), PAPER, H)
    out = list(followed(limiter, [np.full(2, 0.5 * 1.9 * (k * H) ** 2) for k in range(1, 200)]))

    def refuse(*_):
        raise ruckig.RuckigError

    monkeypatch.setattr(limiter, "_catch_up", refuse)
    out += [limiter.follow(np.full(2, 5.0), np.zeros(2)) for _ in range(300)]
    assert_within(np.array(out), PAPER)
    assert out[-1] == pytest.approx(out[-2], abs=1e-12)


def test_the_state_it_tells_is_one_that_a_motion_can_go_on_from():
    """Position after h from (q, q̇, q̈) makes the second difference q̈."""
    limiter = Limiter(np.zeros(1), PAPER, H)
    out = followed(limiter, [np.array([0.9 * (k * H) ** 2]) for k in range(1, 50)])
    following = limiter.q + H * limiter.qd + 0.5 * H**2 * limiter.qdd
    assert following - 2 * out[-1] + out[-2] == pytest.approx(limiter.qdd * H**2, abs=1e-15)
    assert limiter.qdd == pytest.approx(1.8, rel=1e-6)
