"""A copy that runs ahead: it does what the original is going to do, and the original never learns of it."""

import numpy as np
import pytest

from tvist_lab.study.recipes import FrequencyError
from tvist_shaping import Fade, Fixed, Polynomial, ShapingError, TvistFilter, shaper
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal
from tvist_shaping.fir import FirDesign
from tvist_shaping.steady import AimedFilter, ProductDesign, ShortDesign, SteadyFilter

from .motions import H, shaped_by

JOINTS = 2
THREE = Drivetrain((9e3, 8e3, 5e4), (0.3, 0.2, 0.0), (150.0, 120.0, 0.0), (15.0, 15.0, 0.0), (1.0, 1.0, 5.0))


def mass(q):
    c, d = np.cos(q)
    return np.array([[4 + 2 * c, 1 + c, 0.2], [1 + c, 1.5, 0.1 * d], [0.2, 0.1 * d, 0.6]])


def fixed(modes):
    return Fixed([6.7, 8.0, 18.0][:modes], [0.3, 0.3, 0.1][:modes])


def polynomial(_modes):
    return Polynomial(
        joints=[0], degree=1, f_d_coefficients=[11.0, -3.0, 2.0], zeta_coefficients=[0.25, 0.05, -0.1],
        f_d_range=(5.0, 17.0), zeta_range=(0.05, 0.5),
    )  # fmt: skip


def modal(modes):
    return Modal(mass, THREE, modes=modes, f_d_min=5.0, zeta_max=0.6)


def mistaken(modes):
    return FrequencyError(modal(modes), 0.1)


ESTIMATORS = {"fixed": fixed, "polynomial": polynomial, "modal": modal, "mistaken": mistaken}


def short(modes):
    return ShortDesign(
        wanted=FirDesign(*((value,) * modes for value in (0.02, 0.05, 1000.0)), shortest=0.05, longest=0.15)
    )


def product(modes):
    return ProductDesign(0.09, modes=modes)


FILTERS = {
    "one mode": lambda make: TvistFilter(shaper("ei"), make(1), joints=JOINTS),
    "product": lambda make: SteadyFilter(product(1), make(1), joints=JOINTS),
    "short": lambda make: SteadyFilter(short(1), make(1), joints=JOINTS),
    "aimed": lambda make: AimedFilter(short(1), make(1), joints=JOINTS),
}
EVERY = [(kind, make) for kind in FILTERS for make in ESTIMATORS]


def path(seed, ticks):
    """A smooth way through joint space that starts at rest at 0, shape (ticks, joints) [rad]."""
    random = np.random.default_rng(seed)
    t = H * np.arange(ticks)[:, None]
    return np.cumsum(
        random.uniform(0.5, 1.5, JOINTS) * (1.0 - np.cos(random.uniform(3, 9, JOINTS) * t)) * H, axis=0
    )


def said(tvist):
    """Everything a filter says of its last tick."""
    return [*tvist.f_d, *tvist.zeta, tvist.delay, tvist.mean_delay, tvist.clipped]


def check(make, runs, seen):
    """Fork in the middle of a run: it repeats the original to the bit, and what it is given changes nothing there.

    Args:
        make: Makes one; equal ones run in parallel.
        runs: Ticks before the fork, and after it.
        seen: What it tells, as numbers.
    """
    whole = path(1, sum(runs))
    before, after = whole[: runs[0]], whole[runs[0] :]
    astray = np.random.default_rng(2).uniform(-3.0, 3.0, after.shape)
    never, forked = make(), make()
    shaped_by(never, before)
    shaped_by(forked, before)
    one, other = forked.fork(), forked.fork()
    told = seen(forked)
    shaped_by(other, astray)
    assert seen(forked) == told
    for q in after:
        expected = never.filter(q)
        np.testing.assert_array_equal(one.filter(q), expected)
        np.testing.assert_array_equal(forked.filter(q), expected)
        other.filter(q[::-1])
        assert seen(one) == seen(forked) == seen(never)
    # A fork of a fork, from where that one has gone.
    np.testing.assert_array_equal(shaped_by(one.fork(), astray), shaped_by(never, astray))


@pytest.mark.parametrize(("row", "kind"), [*enumerate(FILTERS)])
@pytest.mark.parametrize(("column", "estimator"), [*enumerate(ESTIMATORS)])
def test_fork_of_a_filter_repeats_it_bit_for_bit_and_is_independent(row, kind, column, estimator):
    ticks = (0, 1, 90, 402)[(row + column) % 4]
    check(lambda: FILTERS[kind](ESTIMATORS[estimator]), (ticks, 150), said)


def test_fork_of_a_filter_of_several_modes_repeats_it():
    for make in (fixed, modal, mistaken):
        check(lambda make=make: TvistFilter(shaper("zv"), make(2), joints=JOINTS), (200, 100), said)
        check(lambda make=make: SteadyFilter(product(3), make(3), joints=JOINTS), (200, 100), said)
        check(lambda make=make: SteadyFilter(short(2), make(2), joints=JOINTS), (200, 100), said)


def test_fork_of_an_aimed_filter_keeps_its_target():
    def make():
        tvist = AimedFilter(short(1), modal(1), joints=JOINTS)
        tvist.aim([1.0, 0.5])
        return tvist

    check(make, (200, 200), said)


@pytest.mark.parametrize(("estimator", "ticks"), [*zip(ESTIMATORS, (0, 1, 100, 400), strict=True)])
def test_fork_of_a_fade_repeats_it_bit_for_bit(estimator, ticks):
    """In its first tick, under way, and finished; also where both filters ask one estimator."""

    def make(shared):
        old = TvistFilter(shaper("zv"), ESTIMATORS[estimator](1), joints=JOINTS)
        own = old.estimator if shared else ESTIMATORS[estimator](1)
        new = TvistFilter(shaper("ei"), own, joints=JOINTS)
        return Fade(old, new, velocity=6.0, acceleration=80.0, jerk=1e4)

    def seen(fade):
        return [fade.share, fade.finished, *said(fade.old), *said(fade.new)]

    shares = []
    for shared in (False, True):
        check(lambda shared=shared: make(shared), (ticks, 200), seen)
        fade = make(shared)
        shaped_by(fade, path(1, ticks))
        shares.append(fade.share)
        assert fade.fork().old is not fade.old
    assert {0: 0.0, 1: 0.0, 400: 1.0}.get(ticks, shares[0]) == shares[0]
    assert ticks != 100 or 0.0 < shares[0] < 1.0


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
def test_shaping_a_line_parameter_equals_shaping_the_joints(kind, make):
    along, joints = on(kind, make, straight), FILTERS[kind](ESTIMATORS[make])
    joints.reset(straight(np.zeros(1)))
    for x in parameter():
        np.testing.assert_allclose(straight(along.filter(x)), joints.filter(straight(x)), atol=1e-9)
        np.testing.assert_allclose(along.f_d, joints.f_d, rtol=1e-7)


@pytest.mark.parametrize("make", ["polynomial", "modal"])
def test_modes_are_those_at_the_posture_of_the_previous_parameter(make):
    tvist, estimator, before = on("one mode", make, round_about), ESTIMATORS[make](1), np.zeros(1)
    estimator.settle(round_about(before))
    for x in parameter()[:300]:
        shaped = tvist.filter(x)
        np.testing.assert_allclose(tvist.f_d, estimator.estimate(round_about(before))[0], rtol=1e-9)
        before = shaped


def test_aimed_filter_has_the_modes_at_the_end_of_the_path():
    tvist, other = on("aimed", "polynomial", round_about), FILTERS["aimed"](ESTIMATORS["polynomial"])
    tvist.aim([2.0])
    other.aim(round_about([2.0]))
    assert said(tvist) == said(other)


@pytest.mark.parametrize("kind", FILTERS)
def test_fade_continues_along_the_path(kind):
    old, new, x = on("one mode", "fixed", round_about), FILTERS[kind](ESTIMATORS["polynomial"]), parameter()
    shaped_by(old, x[:150])
    fade = Fade(old, new, **LIMITS)
    assert new.width == 1
    shaped = shaped_by(fade, [*x[150:], *[x[-1]] * 400])
    assert fade.finished
    assert (shaped[-1] == x[-1]).all()
    assert (np.abs(np.diff(shaped[:, 0], 2)) <= LIMITS["acceleration"] * 0.002**2).all()


@pytest.mark.parametrize(("kind", "make"), EVERY)
def test_reset_to_joint_angles_leaves_nothing_of_the_path(kind, make):
    tvist, fresh = on(kind, make, round_about), FILTERS[kind](ESTIMATORS[make])
    shaped_by(tvist, parameter()[:100])
    q = np.ones(JOINTS)
    tvist.reset(q)
    fresh.reset(q)
    samples = q + parameter()
    assert (shaped_by(tvist, samples) == shaped_by(fresh, samples)).all()
    assert said(tvist) == said(fresh)


def test_samples_of_another_width_are_refused():
    tvist = on("one mode", "fixed", round_about)
    with pytest.raises(ShapingError, match="shape"):
        tvist.filter(np.zeros(JOINTS))
    with pytest.raises(ShapingError, match="shape"):
        tvist.reset([0.0])
