"""A filter that shapes the parameter of a path, with the modes at the joint angles there."""

import numpy as np
import pytest

from tvist_shaping import Fade, ShapingError

from .test_fork import ESTIMATORS, EVERY, FILTERS, JOINTS, output, said

LIMITS = {"velocity": 7.0, "acceleration": 34.0, "jerk": 600.0}


def parameter(ticks: int = 500) -> np.ndarray:
    """From 0 to 2, smoothly, and at rest there for a while, shape (ticks, 1)."""
    share = np.clip(np.arange(ticks) / (0.6 * ticks), 0.0, 1.0)
    return 2.0 * (share**3 * (10.0 - 15.0 * share + 6.0 * share**2))[:, None]


def straight(x):
    return np.array([0.3, -0.2]) + np.array([1.0, -0.4]) * x


def round_about(x):
    return np.array([np.sin(x[0]), 1.0 - np.cos(x[0])])


def on(kind, make, posture, start=0.0):
    tvist = FILTERS[kind](ESTIMATORS[make])
    tvist.reset([start], posture)
    return tvist


@pytest.mark.parametrize(("kind", "make"), EVERY)
def test_on_a_straight_line_it_is_to_shape_the_joints(kind, make):
    along, joints = on(kind, make, straight), FILTERS[kind](ESTIMATORS[make])
    joints.reset(straight(np.zeros(1)))
    for x in parameter():
        np.testing.assert_allclose(straight(along.filter(x)), joints.filter(straight(x)), atol=1e-9)
        np.testing.assert_allclose(along.f_d, joints.f_d, rtol=1e-7)


@pytest.mark.parametrize("make", ["polynomial", "modal"])
def test_the_modes_are_those_at_the_joints_of_the_shaped_parameter_a_tick_before(make):
    tvist, estimator, before = on("one mode", make, round_about), ESTIMATORS[make](1), np.zeros(1)
    estimator.settle(round_about(before))
    for x in parameter()[:300]:
        shaped = tvist.filter(x)
        np.testing.assert_allclose(tvist.f_d, estimator.estimate(round_about(before))[0], rtol=1e-9)
        before = shaped


def test_an_aimed_filter_has_the_modes_where_the_parameter_ends():
    tvist, other = on("aimed", "polynomial", round_about), FILTERS["aimed"](ESTIMATORS["polynomial"])
    tvist.aim([2.0])
    other.aim(round_about([2.0]))
    assert said(tvist) == said(other)


@pytest.mark.parametrize(("kind", "make"), EVERY)
def test_a_fork_gives_the_same_bits_and_changes_nothing(kind, make):
    tvist, x = on(kind, make, round_about), parameter()
    output(tvist, x[:200])
    fork = tvist.fork()
    ahead = output(fork, x[200:])
    assert (ahead == output(tvist, x[200:])).all()


@pytest.mark.parametrize("kind", FILTERS)
def test_a_fade_goes_on_with_the_parameter_of_the_filter_before(kind):
    old, new, x = on("one mode", "fixed", round_about), FILTERS[kind](ESTIMATORS["polynomial"]), parameter()
    output(old, x[:150])
    fade = Fade(old, new, **LIMITS)
    assert new.width == 1
    shaped = output(fade, [*x[150:], *[x[-1]] * 400])
    assert fade.finished
    assert (shaped[-1] == x[-1]).all()
    assert (np.abs(np.diff(shaped[:, 0], 2)) <= LIMITS["acceleration"] * 0.002**2).all()


@pytest.mark.parametrize(("kind", "make"), EVERY)
def test_put_back_to_the_joints_it_is_as_it_was(kind, make):
    tvist, fresh = on(kind, make, round_about), FILTERS[kind](ESTIMATORS[make])
    output(tvist, parameter()[:100])
    q = np.ones(JOINTS)
    tvist.reset(q)
    fresh.reset(q)
    samples = q + parameter()
    assert (output(tvist, samples) == output(fresh, samples)).all()
    assert said(tvist) == said(fresh)


def test_samples_of_another_width_are_refused():
    tvist = on("one mode", "fixed", round_about)
    with pytest.raises(ShapingError, match="shape"):
        tvist.filter(np.zeros(JOINTS))
    with pytest.raises(ShapingError, match="shape"):
        tvist.reset([0.0])
