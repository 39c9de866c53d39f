import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import (
    SHAPERS,
    Estimator,
    EstimatorError,
    FilterError,
    Fixed,
    Polynomial,
    ShapingError,
    TvistFilter,
    product,
    shaper,
    zv,
)
from tvist_shaping import filter as module
from tvist_shaping.filter import QUICKEST
from tvist_shaping.named import make_filter
from tvist_shaping.steady import ProductDesign, ShortDesign, SteadyFilter

from .motions import H, double_s, shaped_by

DESIGNS = {"product": lambda: ProductDesign(0.13), "short": ShortDesign}
names = st.sampled_from([*SHAPERS, *DESIGNS])


class Jumping(Estimator):
    """Other modes every tick, without any sense."""

    f_d_min = 5.0

    def __init__(self, seed, name="zv", modes=2):
        self.modes, self.zeta_max = modes, 0.9 * SHAPERS[name].zeta_max
        self.random = np.random.default_rng(seed)
        self.seen = []

    def estimate(self, q):
        self.seen.append(q.copy())
        f_d = self.random.uniform(5.0, 30.0, self.modes)
        return f_d, self.random.uniform(0.0, self.zeta_max, self.modes)


def jumping(name, seed, joints):
    """A filter by the name of a shaper or a design, whose modes jump at every tick."""
    if name in SHAPERS:
        return TvistFilter(shaper(name), Jumping(seed, name), joints=joints)
    design = DESIGNS[name]()
    return SteadyFilter(design, Jumping(seed, modes=design.modes), joints=joints)


@examples(30)
@given(names, st.integers(0, 2**32 - 1), st.lists(st.floats(-7.0, 7.0), min_size=3, max_size=3))
@example("product", 0, [1.1, -2.0, 6.9])
@example("short", 0, [1.1, -2.0, 6.9])
def test_reference_at_rest_passes_unchanged_while_the_modes_jump(name, seed, q):
    tvist = jumping(name, seed, 3)
    tvist.reset(q)
    for shaped in shaped_by(tvist, [q] * 50):
        np.testing.assert_array_equal(shaped, q)


@examples(15)
@given(names, st.integers(0, 2**32 - 1))
@example("product", 0)
@example("short", 0)
def test_end_of_a_motion_is_reached_exactly_while_the_modes_jump(name, seed):
    random = np.random.default_rng(seed)
    tvist = jumping(name, seed, 2)
    shaped_by(tvist, np.cumsum(random.normal(size=(200, 2)), axis=0))
    end = random.normal(size=2)
    np.testing.assert_array_equal(shaped_by(tvist, [end] * (tvist._reach + 1))[-1], end)


def test_output_is_the_convolution_with_the_impulses():
    h, f_d, zeta = 0.002, 7.3, 0.2
    t = h * np.arange(600)
    smooth = np.sin(3.0 * t) * t**2
    tvist = TvistFilter(shaper("zvd"), Fixed([f_d], [zeta]), joints=1, period=h)
    shaped = np.array([tvist.filter([x])[0] for x in smooth])
    late = t[:, None] - tvist.impulses.tau
    direct = (np.where(late > 0.0, np.sin(3.0 * late) * late**2, 0.0) * tvist.impulses.A).sum(axis=1)
    np.testing.assert_allclose(shaped, direct, atol=1e-7)


def test_estimator_gets_the_previous_shaped_reference():
    estimator = Jumping(0)
    tvist = TvistFilter(shaper("zv"), estimator, joints=1)
    estimator.seen.clear()
    shaped = [tvist.filter([x]) for x in (1.0, 2.0, 3.0)]
    np.testing.assert_array_equal(estimator.seen, [np.zeros(1), *shaped[:-1]])


def test_filter_reports_modes_impulses_and_delay_of_the_last_tick():
    tvist = TvistFilter(shaper("zv"), Fixed([6.7, 15.0], [0.34, 0.14]), joints=6)
    tvist.filter(np.zeros(6))
    np.testing.assert_array_equal(tvist.f_d, [6.7, 15.0])
    np.testing.assert_array_equal(tvist.zeta, [0.34, 0.14])
    both = product([zv(6.7, 0.34), zv(15.0, 0.14)])
    np.testing.assert_array_equal(tvist.impulses.A, both.A)
    assert tvist.delay == both.duration == pytest.approx(0.5 / 6.7 + 0.5 / 15.0)


def test_clamped_mode_is_reported_only_while_it_is_clamped():
    """The filter goes on with the held mode: it is inside what was checked when it was made."""

    class Holds(Estimator):
        modes, f_d_min, zeta_max = 1, 5.0, 0.3

        def estimate(self, q):
            self.clipped = bool(q[0] > 1.0)
            return np.array([5.0 if self.clipped else 7.0]), np.array([0.1])

    tvist = TvistFilter(shaper("zv"), Holds(), joints=1)
    assert not tvist.clipped
    tvist.reset([2.0])
    assert tvist.clipped
    said = []
    for _ in range(60):
        tvist.filter([0.0])
        said.append(tvist.clipped)
    assert said[0]
    assert not said[-1]
    assert not tvist.replace(estimator=Fixed([7.0], [0.1])).clipped


def test_output_is_a_copy():
    tvist = TvistFilter(shaper("zv"), Fixed([10.0], [0.1]), joints=1)
    first = tvist.filter([1.0])
    kept = first.copy()
    second = tvist.filter([2.0])
    np.testing.assert_array_equal(first, kept)
    second[:] = 100.0
    assert tvist.filter([2.0])[0] < 3.0


def test_shaper_longer_than_max_delay_is_refused_with_advice():
    with pytest.raises(FilterError, match=r"'ei3' lasts 2 periods .* 1 Hz: take a shorter shaper") as error:
        TvistFilter(shaper("ei3"), Fixed([1.0], [0.1]), joints=6)
    assert error.value.field == "duration"
    assert error.value.value == 2.0


def test_estimator_that_needs_more_joints_is_refused():
    with pytest.raises(EstimatorError, match=r"at least 3 joints"):
        TvistFilter(shaper("zv"), estimator(), joints=2)


def test_sample_of_another_size_is_refused():
    tvist = TvistFilter(shaper("zv"), estimator(), joints=4)
    for wrong in (0.0, [0.0], [0.0] * 3, np.zeros((3, 5))):
        for give in (tvist.filter, tvist.reset, tvist.filter_all):
            with pytest.raises(ShapingError, match=r"shape"):
                give(wrong)
    assert tvist.filter_all(np.empty((0, 4))).shape == (0, 4)


def estimator():
    random = np.random.default_rng(3)
    return Polynomial(
        joints=(1, 2), degree=2,
        f_d_coefficients=[9.0, *random.uniform(-0.6, 0.6, 12)],
        zeta_coefficients=[0.1, *random.uniform(-0.02, 0.02, 12)],
        f_d_range=(5.0, 15.0), zeta_range=(0.01, 0.18),
    )  # fmt: skip


def walk(ticks, seed=1, joints=4):
    """A smooth walk with a rest in the middle and at the end."""
    steps = np.random.default_rng(seed).uniform(-1e-3, 1e-3, (ticks, joints))
    steps[ticks // 3 : ticks // 2] = 0.0
    steps[-ticks // 4 :] = 0.0
    return np.cumsum(np.cumsum(steps, axis=0) * np.linspace(1.0, 0.0, ticks)[:, None] ** 2, axis=0)


def assert_equal(one, other):
    for name in ("f_d", "zeta", "clipped", "fault", "delay", "mean_delay", "settled"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.window(), other.window())
    assert one._line.still == other._line.still


@pytest.mark.parametrize("name", SHAPERS)
def test_filter_all_equals_filter_with_every_shaper(name):
    one, other = (TvistFilter(SHAPERS[name], estimator(), joints=4) for _ in range(2))
    for part in np.split(walk(600), [1, 3, 250, 255, 500]):
        found = one.filter_all(part)
        np.testing.assert_array_equal(found, np.array([other.filter(sample) for sample in part]))
        assert_equal(one, other)


@pytest.mark.parametrize(("name", "modes"), [("zv", 2), ("auto", 4), ("elastic", 1)])
def test_filter_all_equals_filter_with_other_modes(name, modes):
    known = Fixed([7.0, 15.0, 21.0, 33.0][:modes], [0.1] * modes)
    one, other = (make_filter(name, known, joints=4) for _ in range(2))
    samples = walk(300)
    np.testing.assert_array_equal(one.filter_all(samples), [other.filter(sample) for sample in samples])


def test_filter_all_equals_filter_along_a_path():
    one, other = (TvistFilter(SHAPERS["zv"], estimator(), joints=4) for _ in range(2))
    for tvist in (one, other):
        tvist.reset(np.zeros(1), lambda s: np.array([s[0], s[0] ** 2, 0.5 * s[0], 0.0]))
    samples = walk(200, joints=1)
    np.testing.assert_array_equal(one.filter_all(samples), [other.filter(sample) for sample in samples])


def test_filter_all_continues_where_the_kernel_stops(monkeypatch):
    """A mode that a kernel refuses is the business of the function of the shaper, at that sample only."""
    tvist, plain = (TvistFilter(SHAPERS["zv"], estimator(), joints=4) for _ in range(2))
    samples, whole = walk(200), module.shape_all

    def stops_early(given, *rest):
        return whole(given[:70], *rest)

    monkeypatch.setattr(module, "shape_all", stops_early)
    np.testing.assert_array_equal(tvist.filter_all(samples), [plain.filter(sample) for sample in samples])
    assert_equal(tvist, plain)


class Jump(Estimator):
    """One mode, whose frequency and damping jump at q = 1."""

    abrupt = True
    modes, f_d_min, zeta_max = 1, 5.0, 0.5

    def estimate(self, q):
        far = q[0] >= 1.0
        return np.array([9.0 if far else 6.0]), np.array([0.1 if far else 0.3])


def played(tvist, q):
    tvist.reset(q[0])
    return np.array([(tvist.filter(sample)[0], tvist.f_d[0], tvist.zeta[0]) for sample in q])


def test_jump_of_the_modes_is_followed_at_a_limited_rate():
    q = np.linspace(0.0, 4.0, 700)[:, None]
    shaped, f_d, zeta = played(TvistFilter(shaper("zvd"), Jump(), joints=1), q).T
    assert 0.9 < np.abs(np.diff(f_d) / f_d[:-1]).max() / H / QUICKEST[0] <= 1.0 + 1e-6
    assert np.abs(np.diff(zeta)).max() / H <= QUICKEST[1] * (1.0 + 1e-6)
    begun = 150  # its start is abrupt by itself
    assert np.abs(np.diff(shaped[begun:], 2)).max() / H**2 < 20.0  # a jump would be hundreds
    assert f_d[-1] > 8.5


def test_modes_are_exact_at_rest():
    q = np.concatenate((np.linspace(0.0, 1.2, 200), np.full(400, 1.2)))[:, None]
    tvist = TvistFilter(shaper("zv"), Jump(), joints=1)
    shaped, *_ = played(tvist, q).T
    assert (tvist.f_d[0], tvist.zeta[0]) == (9.0, 0.1)
    assert shaped[-1] == 1.2


STROKE = 5.0 * np.pi / 6.0  # [rad]
MOVE = double_s([STROKE])[:, 0]


@pytest.fixture
def modes():
    """From the paper's f_d and ζ of the stretched arm to those of the bent one, with the cosine of q."""
    bent = 1.0 - np.cos(STROKE)
    f_d, zeta = (15.0 - 6.7) / bent, (0.14 - 0.34) / bent
    return Polynomial(
        joints=[0],
        degree=1,
        f_d_coefficients=[6.7 + f_d, -f_d, 0.0],
        zeta_coefficients=[0.34 + zeta, -zeta, 0.0],
        f_d_range=(5.0, 17.0),
        zeta_range=(0.05, 0.45),
    )


def peak_acceleration(position):
    return np.abs(np.diff(position, 2)).max() / H**2


def shape(position, name, modes):
    tvist = TvistFilter(shaper(name), modes, joints=1, period=H)
    tvist.reset([position[0]])
    return shaped_by(tvist, position[:, None])[:, 0]


def test_acceleration_stays_near_its_limit_while_the_frequency_changes(modes):
    assert peak_acceleration(shape(MOVE, "zv", modes)) < 2.1
    assert peak_acceleration(shape(MOVE[::-1], "zv", modes)) < 2.1


@pytest.mark.parametrize("name", ["zv", "zvd", "ei", "ei_exact", "mzv", "si", "zvdd", "ei2", "zvddd", "ei3"])
def test_positive_shapers_keep_the_limit_and_do_not_overshoot(name, modes):
    shaped = shape(MOVE, name, modes)
    assert peak_acceleration(shaped) < 2.2
    assert shaped.min() >= -1e-6
    assert shaped.max() <= STROKE + 1e-6


def test_shaped_move_ends_half_a_period_after_the_reference(modes):
    shaped = shape(MOVE, "zv", modes)
    assert shaped[-1] == MOVE[-1]
    last = [np.flatnonzero(np.abs(np.diff(position)) > 1e-9)[-1] for position in (MOVE, shaped)]
    assert H * (last[1] - last[0]) == pytest.approx(0.5 / 15.0, abs=2.0 * H)
