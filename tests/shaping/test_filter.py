import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import (
    SHAPERS,
    Estimator,
    EstimatorError,
    FilterError,
    Fixed,
    Polynomial,
    Shaper,
    ShapingError,
    TvistFilter,
    product,
    shaper,
    zv,
)

names = st.sampled_from(list(SHAPERS))


class Jumping(Estimator):
    """Other modes every tick, without any sense."""

    modes = 2
    f_d_min = 5.0
    zeta_max = 0.9

    def __init__(self, seed, name="zv"):
        self.zeta_max = 0.9 * SHAPERS[name].zeta_max
        self.random = np.random.default_rng(seed)
        self.seen = []

    def estimate(self, q):
        self.seen.append(q.copy())
        return self.random.uniform(5.0, 30.0, 2), self.random.uniform(0.0, self.zeta_max, 2)


@examples(30)
@given(names, st.integers(0, 2**32 - 1), st.lists(st.floats(-7.0, 7.0), min_size=3, max_size=3))
def test_a_reference_at_rest_passes_bit_for_bit_whatever_the_parameters_do(name, seed, q):
    tvist = TvistFilter(shaper(name), Jumping(seed, name), joints=3)
    tvist.reset(q)
    for _ in range(50):
        np.testing.assert_array_equal(tvist.filter(q), q)


@examples(15)
@given(names, st.integers(0, 2**32 - 1))
def test_the_end_of_a_motion_is_reached_bit_for_bit_whatever_the_parameters_do(name, seed):
    random = np.random.default_rng(seed)
    tvist = TvistFilter(shaper(name), Jumping(seed, name), joints=2)
    for q in np.cumsum(random.normal(size=(200, 2)), axis=0):
        tvist.filter(q)
    end = random.normal(size=2)
    longest = 2 * SHAPERS[name].duration_periods / 5.0 / 0.002
    for _ in range(int(longest) + 4):
        last = tvist.filter(end)
    np.testing.assert_array_equal(last, end)


@examples(15)
@given(names, st.integers(0, 2**32 - 1), st.floats(0.1, 2.0))
def test_the_gain_is_one_a_shift_of_the_reference_is_a_shift_of_the_output(name, seed, shift):
    reference = np.random.default_rng(seed).normal(size=(100, 1))
    outputs = []
    for offset in (0.0, shift):
        tvist = TvistFilter(shaper(name), Jumping(seed, name), joints=1)
        tvist.reset([offset])
        outputs.append(np.array([tvist.filter(q + offset) for q in reference]))
    np.testing.assert_allclose(outputs[1] - outputs[0], shift, atol=1e-12)


def test_the_output_is_the_convolution_with_the_impulses():
    h, f_d, zeta = 0.002, 7.3, 0.2
    t = h * np.arange(600)
    smooth = np.sin(3.0 * t) * t**2
    tvist = TvistFilter(shaper("zvd"), Fixed([f_d], [zeta]), joints=1, period=h)
    shaped = np.array([tvist.filter([x])[0] for x in smooth])
    late = t[:, None] - tvist.impulses.tau
    direct = (np.where(late > 0.0, np.sin(3.0 * late) * late**2, 0.0) * tvist.impulses.A).sum(axis=1)
    np.testing.assert_allclose(shaped, direct, atol=1e-7)


def test_the_estimator_reads_the_previous_shaped_reference():
    estimator = Jumping(0)
    tvist = TvistFilter(shaper("zv"), estimator, joints=1)
    estimator.seen.clear()
    shaped = [tvist.filter([x]) for x in (1.0, 2.0, 3.0)]
    np.testing.assert_array_equal(estimator.seen, [np.zeros(1), *shaped[:-1]])


def test_all_joints_get_the_same_impulses():
    tvist = TvistFilter(shaper("ei2"), Jumping(1), joints=3)
    direction = np.array([1.0, -2.0, 0.5])
    for x in np.random.default_rng(1).normal(size=100):
        shaped = tvist.filter(x * direction)
        np.testing.assert_allclose(shaped, shaped[0] * direction, atol=1e-13)


def test_the_modes_impulses_and_delay_of_the_last_tick_can_be_read():
    tvist = TvistFilter(shaper("zv"), Fixed([6.7, 15.0], [0.34, 0.14]), joints=6)
    tvist.filter(np.zeros(6))
    np.testing.assert_array_equal(tvist.f_d, [6.7, 15.0])
    np.testing.assert_array_equal(tvist.zeta, [0.34, 0.14])
    both = product([zv(6.7, 0.34), zv(15.0, 0.14)])
    np.testing.assert_array_equal(tvist.impulses.A, both.A)
    assert tvist.delay == both.duration == pytest.approx(0.5 / 6.7 + 0.5 / 15.0)


def test_a_mode_that_its_estimator_does_not_believe_is_said_and_no_longer_when_it_does():
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


def test_what_the_filter_returned_is_the_callers_own():
    tvist = TvistFilter(shaper("zv"), Fixed([10.0], [0.1]), joints=1)
    first = tvist.filter([1.0])
    kept = first.copy()
    second = tvist.filter([2.0])
    np.testing.assert_array_equal(first, kept)
    second[:] = 100.0
    assert tvist.filter([2.0])[0] < 3.0


def test_reset_forgets_the_motion():
    tvist = TvistFilter(shaper("ei3"), Fixed([7.0], [0.1]), joints=2)
    for x in np.random.default_rng(0).normal(size=(50, 2)):
        tvist.filter(x)
    tvist.reset([1.0, 2.0])
    np.testing.assert_array_equal(tvist.filter([1.0, 2.0]), [1.0, 2.0])


def test_a_replaced_filter_goes_on_from_rest():
    tvist = TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), joints=2, max_delay=0.5)
    tvist.reset([1.0, 2.0])
    other = tvist.replace(shaper=shaper("zvd"))
    assert (other.shaper.name, other.estimator.f_d_min, other.max_delay) == ("zvd", 7.0, 0.5)
    np.testing.assert_array_equal(other.filter([1.0, 2.0]), [1.0, 2.0])
    assert tvist.replace(estimator=Fixed([9.0], [0.1])).f_d[0] == 9.0
    assert tvist.shaper.name == "zv"


def test_a_shaper_too_long_for_the_line_is_refused_with_what_to_do():
    with pytest.raises(FilterError, match=r"'ei3' lasts 2 periods .* 1 Hz: take a shorter shaper") as error:
        TvistFilter(shaper("ei3"), Fixed([1.0], [0.1]), joints=6)
    assert error.value.field == "duration"
    assert error.value.value == 2.0


def test_the_longest_shaper_that_fits_the_line_runs():
    tvist = TvistFilter(shaper("ei3"), Fixed([4.0, 4.0], [0.1, 0.1]), joints=1, period=0.003, max_delay=1.0)
    assert tvist.delay == pytest.approx(1.0)
    tvist.filter([1.0])


def test_a_damping_beyond_the_shaper_is_refused_with_what_to_do():
    mine = Shaper("mine", "valid to 0.2", zv, 0.5, zeta_max=0.2)
    with pytest.raises(
        FilterError, match=r"less than 0.2, as shaper 'mine' demands; take a shaper with"
    ) as error:
        TvistFilter(mine, Fixed([7.0], [0.3]), joints=1)
    assert error.value.field == "zeta_max"
    TvistFilter(mine, Fixed([7.0], [0.1]), joints=1)


@pytest.mark.parametrize(
    "numbers", [{"joints": 0}, {"period": 0.0}, {"period": float("nan")}, {"max_delay": float("inf")}]
)
def test_numbers_out_of_range_are_refused_by_name(numbers):
    with pytest.raises(FilterError, match=next(iter(numbers))):
        TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), **({"joints": 1} | numbers))


def test_an_estimator_of_more_joints_than_there_are_is_refused_at_construction():
    elbow = Polynomial(
        joints=[2],
        degree=0,
        f_d_coefficients=[9.0],
        zeta_coefficients=[0.2],
        f_d_range=(6.0, 15.0),
        zeta_range=(0.0, 0.5),
    )
    with pytest.raises(EstimatorError, match=r"at least 3 joints"):
        TvistFilter(shaper("zv"), elbow, joints=2)


def test_a_sample_of_another_size_is_refused():
    tvist = TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), joints=2)
    for wrong in (0.0, [0.0], [0.0] * 3):
        with pytest.raises(ShapingError, match=r"shape"):
            tvist.filter(wrong)
        with pytest.raises(ShapingError, match=r"shape"):
            tvist.reset(wrong)


def test_a_filter_prints_its_parameters():
    assert repr(TvistFilter(shaper("zv"), Fixed([7.0], [0.1]), joints=2)) == (
        "TvistFilter('zv', Fixed(f_d=[7.0], zeta=[0.1]), joints=2, period=0.002, max_delay=1.0)"
    )
