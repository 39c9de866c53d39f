import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import SHAPERS, Estimator, Fade, Fixed, TvistFilter, product, residual, zv
from tvist_shaping.fir import FirDesign
from tvist_shaping.impulse_train import Impulses
from tvist_shaping.named import AIMED, DESIGNS
from tvist_shaping.steady import ProductDesign, ShortDesign, SteadyFilter
from tvist_shaping.taps import average, length, mean_delay, product_taps

from .motions import ACCELERATION, JERK, VELOCITY, H, double_s, oscillation_left, shaped_by

F_D, ZETA = (6.7, 8.0, 18.0, 35.0), (0.3, 0.3, 0.1, 0.1)
MEAN = mean_delay(np.array(F_D[:3]), np.zeros(3))
KINDS = {"product": lambda: ProductDesign(MEAN), "short": ShortDesign}


class Arm(Estimator):
    """Modes that go up and down with q, as an arm's do; what they are at q = 0 is the lowest."""

    modes, f_d_min, zeta_max = 1, F_D[0], 0.4

    def __init__(self, modes, depth=1.0):
        self.modes, self.depth = modes, depth

    def estimate(self, q):
        bend = self.depth * np.sin(0.7 * q[0]) ** 2
        f_d, zeta = np.array(F_D[: self.modes]), np.array(ZETA[: self.modes])
        return f_d * (1.0 + bend), zeta


class Jumping(Arm):
    """Other modes every time, without any sense, within the same bounds."""

    def __init__(self, modes, seed):
        super().__init__(modes)
        self.random = np.random.default_rng(seed)

    def estimate(self, q):  # noqa: ARG002  whatever it is
        stretch = self.random.uniform(1.0, 2.0)
        return stretch * np.array(F_D[: self.modes]), self.random.uniform(0.25, 0.4, self.modes)


def a_filter(kind, estimator=Arm, **numbers):
    """A filter of one joint, whose estimator is of this class or is this one."""
    design = KINDS[kind]()
    made = estimator(design.modes, **numbers) if isinstance(estimator, type) else estimator
    return SteadyFilter(design, made, joints=1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_constant_velocity_is_kept_while_the_modes_change(kind, seed):
    """The mean delay is the same at every tick: a ramp comes out as itself, that much later."""
    tvist = a_filter(kind, Jumping, seed=seed)
    ramp = VELOCITY * H * np.arange(2000.0)[:, None]
    shaped = shaped_by(tvist, ramp)[tvist.design.taps :]
    late = ramp[tvist.design.taps :] - VELOCITY * tvist.design.mean_delay
    np.testing.assert_allclose(shaped, late, rtol=0, atol=1e-9)
    assert np.abs(np.diff(shaped, axis=0) / H - VELOCITY).max() < 1e-7
    assert not tvist.clipped


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stroke", [0.3, 3.0])
def test_move_at_the_limits_stays_within_them(kind, stroke):
    reference = double_s([stroke])
    limits = [np.abs(np.diff(reference, order, axis=0)).max() / H**order for order in (1, 2)]
    shaped = shaped_by(a_filter(kind), reference)
    assert np.abs(np.diff(shaped, axis=0)).max() / H <= limits[0] * (1 + 1e-4)
    assert np.abs(np.diff(shaped, 2, axis=0)).max() / H**2 <= limits[1] * 1.003
    np.testing.assert_array_equal(shaped[-1], reference[-1])


@pytest.mark.parametrize(("kind", "share"), [("product", 0.05), ("short", 1.0)])
def test_residual_of_each_mode_is_at_most_the_permitted_one(kind, share):
    """By the formula on the taps, and by an oscillator driven with a shaped step, against one with the step itself."""
    tvist = a_filter(kind, Fixed(F_D[:3], ZETA[:3]) if kind == "product" else Fixed(F_D, ZETA))
    taps = tvist._taps[: np.flatnonzero(np.abs(tvist._taps) > 1e-12)[-1] + 1]
    impulses = Impulses(taps / taps.sum(), H * np.arange(taps.size))
    step = np.ones((impulses.tau.size, 1))
    shaped = np.concatenate([[0.0], shaped_by(tvist, step)[:, 0]])
    assert shaped[-1] == 1.0
    assert not tvist.clipped
    for f_d, zeta, asked in zip(tvist.f_d, tvist.zeta, FirDesign().residual, strict=False):
        left = oscillation_left(shaped, f_d, zeta) / oscillation_left([0.0, 1.0], f_d, zeta)
        assert left <= share * asked
        # The length of the short one is still settling while the step goes through.
        assert left == pytest.approx(residual(f_d, zeta, impulses), abs=1e-10 if kind == "product" else 2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_little_vibration_is_left_after_a_short_move(kind):
    """Of a short jog, which excites the lowest mode most, less than a tenth is left; the modes move on the way."""
    reference, tvist = double_s([0.1]), a_filter(kind, depth=0.2)
    shaped = shaped_by(tvist, reference)
    stop = [np.flatnonzero(np.abs(np.diff(x[:, 0])) > 1e-12)[-1] + 2 for x in (reference, shaped)]
    (f_d, *_), (zeta, *_) = tvist.estimator.estimate(reference[-1])
    unshaped, left = (
        oscillation_left(x[:end, 0], f_d, zeta) for x, end in zip((reference, shaped), stop, strict=True)
    )
    assert left < 0.1 * unshaped


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("steady_first", [True, False])
def test_fade_to_or_from_the_papers_filter_has_no_step(kind, steady_first):
    reference = double_s([2.0])
    slow = 0.7 * reference  # room for the fade
    make = [lambda: a_filter(kind), lambda: TvistFilter(SHAPERS["zv"], Arm(1), joints=1)]
    old, new = (make[0 if steady_first else 1](), make[1 if steady_first else 0]())
    output, fade = [], None
    for i, q in enumerate(slow):
        if i == 500:
            fade = Fade(old, new, velocity=VELOCITY, acceleration=ACCELERATION, jerk=JERK)
        output.append((old if fade is None else fade).filter(q))
    assert fade.finished
    np.testing.assert_array_equal(output[-1], slow[-1])
    assert np.abs(np.diff(output, axis=0)).max() / H <= VELOCITY
    assert np.abs(np.diff(output, 2, axis=0)).max() / H**2 <= ACCELERATION * 1.005


def test_product_that_does_not_fit_is_reported_as_clipped():
    """Too long on average, where the mean delay is the product's own; and longer than what is held."""
    slow = Fixed([3.0], [0.05])
    short_of_mean = SteadyFilter(ProductDesign(0.04, modes=1), slow, joints=1)
    assert short_of_mean.clipped
    short_of_room = SteadyFilter(ProductDesign(0.085, modes=1, longest=0.1), slow, joints=1)
    assert short_of_room.clipped
    np.testing.assert_array_equal(short_of_room.filter([0.0]), [0.0])
    assert not SteadyFilter(ProductDesign(0.085, modes=1), slow, joints=1).clipped
    assert not SteadyFilter(ProductDesign(0.04, modes=1), Fixed([7.0], [0.05]), joints=1).clipped


class Falling(Arm):
    """Modes far above what the estimator believes, and where q is large below: held there."""

    f_d_min = 2.0

    def estimate(self, q):
        slow = bool(q[0] > 1.0)
        self.clipped = slow
        f_d = np.full(self.modes, self.f_d_min) if slow else np.array(F_D[: self.modes])
        return f_d, np.array(ZETA[: self.modes])


@pytest.mark.parametrize("kind", KINDS)
def test_low_frequency_beyond_the_buffer_is_reported_only_where_it_occurs(kind):
    """Half periods of three modes at 2 Hz are 0.75 s; the line holds 0.26 s, and 0.15 s."""
    tvist = a_filter(kind, Falling)
    assert not tvist.clipped
    reference = 2.0 * double_s([1.0])
    said = []
    for q in [*reference, *reference[::-1]]:
        out = tvist.filter(q)
        said.append(tvist.clipped)
        assert np.isfinite(out).all()
        assert tvist.delay <= H * (tvist.design.taps - 1)
    assert said[len(reference) - 1]
    assert not said[0]
    assert not said[-1]


@pytest.mark.parametrize("kind", KINDS)
def test_clamped_mode_is_reported_even_if_the_design_fits(kind):
    class Holds(Arm):
        clipped = True

    tvist = a_filter(kind, Holds)
    assert tvist.clipped
    tvist.filter([0.1])
    assert tvist.clipped


def test_unsolved_programme_keeps_the_old_taps_and_is_reported():
    tvist = a_filter("short")
    before = tvist._designed.copy()
    nothing = np.full(4, np.nan)
    tvist.estimator.estimate = lambda _: (nothing, nothing)
    for _ in range(200):
        np.testing.assert_array_equal(tvist.filter([0.0]), [0.0])
        assert tvist.clipped
    np.testing.assert_array_equal(tvist._designed, before)
    del tvist.estimator.estimate
    for _ in range(8):
        tvist.filter([0.0])
    assert not tvist.clipped


@pytest.mark.parametrize("kind", KINDS)
def test_taps_do_not_drift_over_many_ticks(kind):
    tvist = a_filter(kind)
    for i in range(20_000):
        tvist.filter([2.0 * np.sin(1e-3 * i)])
    for _ in range(6000):
        tvist.filter([0.5])
    assert tvist._taps.sum() == pytest.approx(1.0, abs=1e-13)
    assert H * np.arange(tvist.design.taps) @ tvist._taps == pytest.approx(tvist.design.mean_delay, abs=1e-10)
    anew = a_filter(kind)
    anew.reset([0.5])
    # The length's servo stops where no more is left than may be; halving finds the same to a 4096th.
    np.testing.assert_allclose(tvist._taps, anew._taps, atol=1e-12 if kind == "product" else 1e-3)


N = 140
modes = st.lists(st.tuples(st.floats(4.0, 60.0), st.floats(0.0, 0.9)), min_size=1, max_size=4)


def arrays(modes):
    f_d, zeta = np.array(modes, dtype=float).T.copy()
    return f_d, zeta


def tapped(modes, mean, taps=N):
    out = np.empty(taps)
    fits = product_taps(*arrays(modes), mean, H, out)
    return out, fits


@given(modes)
def test_mean_delay_is_that_of_the_product_of_impulses(modes):
    impulses = product([zv(*mode) for mode in modes])
    assert mean_delay(*arrays(modes)) == pytest.approx(impulses.mean_delay, rel=1e-12)


@given(modes, st.floats(0.0, 0.05), st.floats(0.0, 1e4))
def test_taps_and_impulses_give_the_same_result_on_a_cubic(modes, more, seed):
    """Lagrange's cubic is exact for it, so for a constant and a ramp: sum and mean delay are right, too."""
    impulses = product([zv(*mode) for mode in modes])
    taps, fits = tapped(modes, mean_delay(*arrays(modes)) + more, 400)
    assert fits
    cubic = np.random.default_rng(int(seed)).normal(size=4)
    assert np.polyval(cubic, H * np.arange(400)) @ taps == pytest.approx(
        np.polyval(cubic, impulses.tau + more) @ impulses.A, abs=1e-10
    )


@given(modes, st.floats(0.0, 0.05))
def test_taps_suppress_each_of_their_modes(modes, more):
    """What a cubic loses between two ticks grows with (f h)^4: 2 % of a mode of 60 Hz, nothing of a slow one."""
    taps, _ = tapped(modes, mean_delay(*arrays(modes)) + more, 400)
    last = length(taps)
    for f_d, zeta in modes:
        s = 2.0 * np.pi * f_d * (zeta / np.sqrt(1.0 - zeta**2) + 1j)
        waves = np.exp((s * np.arange(400) - s.real * last) * H)[: last + 1] * taps[: last + 1]
        assert abs(waves.sum()) < 0.05 * (abs(s) * H / 0.75) ** 4 + 1e-12


def test_product_with_a_longer_mean_delay_is_kept_and_reported():
    taps, fits = tapped([(5.0, 0.0)], 0.04)
    assert not fits
    assert H * np.arange(N) @ taps == pytest.approx(0.05, abs=1e-12)
    assert taps.sum() == pytest.approx(1.0, abs=1e-12)


def test_impulse_beyond_the_last_tap_is_moved_to_it_and_reported():
    taps, fits = tapped([(2.0, 0.0)], 0.125, 60)
    assert not fits
    assert taps.sum() == pytest.approx(1.0, abs=1e-12)
    assert taps[0] == pytest.approx(0.5)
    assert taps[57] == pytest.approx(0.5)


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_three_running_means_are_a_convolution_with_three_boxes(ticks, seed):
    random = np.random.default_rng(seed)
    vectors = random.dirichlet(np.ones(5), size=80)
    start = vectors[0]
    past, sums, out = np.tile(start, (3, ticks, 1)), np.tile(ticks * start, (3, 1)), np.empty(5)
    box = np.ones(ticks) / ticks
    kernel = np.convolve(np.convolve(box, box), box)
    padded = np.vstack([np.tile(start, (kernel.size, 1)), vectors])
    for i, vector in enumerate(vectors):
        average(vector, past, sums, i % ticks, out)
        end = kernel.size + i + 1
        np.testing.assert_allclose(out, kernel[::-1] @ padded[end - kernel.size : end], atol=1e-13)


def test_shaper_for_a_known_end_leaves_its_three_lowest_modes_at_rest():
    f_d, zeta = (
        np.array([5.0, 12.5, 25.0, 35.0]),
        np.array([0.3, 0.1, 0.05, 0.05]),
    )  # half periods are whole ticks
    design = DESIGNS[AIMED](1.0)
    taps = np.empty(design.taps)
    design.at_target(f_d, zeta, taps)
    impulses = Impulses(taps, H * np.arange(design.taps))
    for f, z in zip(f_d[:3], zeta[:3], strict=True):
        assert residual(f, z, impulses) < 1e-9
