"""Shapers of one's own: run as the built-in ones do, are tried out, and do no harm when they fail."""

import numpy as np
import pytest

from tvist_shaping import (
    BUILT_IN,
    SHAPERS,
    DesignError,
    Filter,
    FirShaper,
    Fixed,
    Impulses,
    Registry,
    Shaper,
    ShaperFailureError,
    ShapingError,
    SteadyFilter,
    TvistFilter,
    UnknownShaperError,
    check_shaper,
    custom,
    make_filter,
    shaper_of,
    zv,
)
from tvist_shaping.own import check_range

REFERENCE = 1.0 - np.cos(np.pi * np.clip(np.arange(0.0, 1.2, 0.002), 0.0, 1.0))


def mean(taps=20, name="mean"):
    return FirShaper(name, "a mean", lambda _f_d, _zeta: np.full(taps, 1.0 / taps), taps=taps)


def shaped(tvist, reference=REFERENCE):
    return np.array([tvist.filter([q])[0] for q in reference])


def exits(f_d, zeta):
    raise SystemExit(3)


def fine(f_d, zeta):
    """Positive impulses."""
    return zv(f_d, zeta)


def fails(f_d, zeta):
    return 1 / 0


WRONG = {
    "raises": (fails, "raises ZeroDivisionError"),
    "exits": (exits, "raises SystemExit: 3"),
    "NaN": (lambda _f_d, _zeta: Impulses([np.nan, 1.0], [0.0, 0.1]), "must be finite"),
    "list": (lambda _f_d, _zeta: [0.5, 0.5], "returns list instead of Impulses"),
    "nothing": (lambda _f_d, _zeta: None, "returns NoneType"),
}
WRONG_TAPS = {
    "raises": (fails, "raises ZeroDivisionError"),
    "NaN": (lambda _f_d, _zeta: [np.nan, 1.0], "not finite"),
    "sum": (lambda _f_d, _zeta: [0.5, 0.4], "sum to 0.9"),
    "shape": (lambda _f_d, _zeta: [[1.0]], "shape (1, 1)"),
    "many": (lambda _f_d, _zeta: np.full(21, 1 / 21), "must be 1 to 20 taps"),
    "none": (lambda _f_d, _zeta: [], "shape (0,)"),
    "peak": (lambda _f_d, _zeta: [2.0, -1.0], "sum to 3: must be at most its peak of 1"),
    "words": (lambda _f_d, _zeta: "taps", "raises ValueError"),
}


class Turning:
    """A function that is right until it is told otherwise."""

    def __init__(self, right, wrong):
        self.right, self.wrong, self.failing = right, wrong, False

    def __call__(self, f_d, zeta):
        return (self.wrong if self.failing else self.right)(f_d, zeta)


def test_shaper_of_a_built_in_keeps_its_name_and_description():
    assert shaper_of(zv).name == "zv"
    assert shaper_of(zv).description == SHAPERS["zv"].description


def test_own_function_equals_the_built_in_shaper_bit_for_bit():
    fixed = Fixed([7.0], [0.1])
    own, built_in = (make_filter(one, fixed, joints=1) for one in (shaper_of(fine, name="mine"), "zv"))
    assert isinstance(own, TvistFilter)
    assert own.name == "mine"
    np.testing.assert_array_equal(shaped(own), shaped(built_in))


def test_fir_filter_is_the_convolution_with_its_taps():
    random = np.random.default_rng(1)
    taps = random.random(30)
    taps /= taps.sum()
    mine = FirShaper("mine", "", lambda _f_d, _zeta: taps, taps=40)
    tvist = make_filter(mine, Fixed([7.0], [0.1]), joints=1)
    assert isinstance(tvist, SteadyFilter)
    assert isinstance(tvist, Filter)
    expected = np.convolve(REFERENCE, taps)[: len(REFERENCE)]
    np.testing.assert_allclose(shaped(tvist), expected, atol=1e-12)
    assert tvist.delay == pytest.approx(29 * 0.002)
    assert tvist.mean_delay == pytest.approx(0.002 * taps @ np.arange(30))


def test_duration_and_peak_of_a_function_are_determined_by_trials():
    made = shaper_of(lambda f_d, _zeta: Impulses([1.2, -0.2], [0.0, 0.7 / f_d]), name="mine")
    assert made.duration_periods == pytest.approx(0.7)
    assert made.peak == pytest.approx(1.4)
    assert (shaper_of(fine).name, shaper_of(fine).description) == ("fine", "Positive impulses.")
    assert shaper_of(fine).peak == 1.0
    assert shaper_of(SHAPERS["ei_exact"].function, name="mine", zeta_max=0.5).zeta_max == 0.5


@pytest.mark.parametrize("name", list(SHAPERS))
def test_every_catalogued_shaper_passes_the_check(name):
    check_shaper(SHAPERS[name])


@pytest.mark.parametrize(("function", "words", "taps"), [
    *((*one, None) for one in WRONG.values()),
    *((*one, 20) for key, one in WRONG_TAPS.items() if key != "peak"),
])  # fmt: skip
def test_failing_function_is_refused_with_the_mode(function, words, taps):
    with pytest.raises(ShaperFailureError, match=r"'mine'.* for f_d = 10 Hz and ζ = 0\.1") as error:
        check_shaper(FirShaper("mine", "", function, taps)) if taps else shaper_of(function, name="mine")
    assert words in str(error.value)
    assert error.value.name == "mine"


def test_function_that_fails_for_some_modes_is_usable_for_others():
    mine = shaper_of(lambda f_d, z: zv(f_d, z) if 5.0 < f_d < 30.0 and z < 0.5 else None, name="mine")
    assert (mine.duration_periods, mine.peak) == (pytest.approx(0.5), 1.0)
    check_range(mine, (5.1, 29.0), (0.0, 0.49), "an arm")
    for f_d, zeta in (((4.9, 20.0), (0.0, 0.1)), ((6.0, 31.0), (0.0, 0.1)), ((6.0, 20.0), (0.0, 0.51))):
        with pytest.raises(ShaperFailureError, match=r"the modes of an arm, .*clip f_d and zeta"):
            check_range(mine, f_d, zeta, "an arm")


@pytest.mark.parametrize("time", [lambda f_d: 0.5 / min(max(f_d, 5.0), 20.0), lambda _: 0.3])
def test_impulse_times_need_not_be_proportional_to_1_over_f_d(time):
    mine = shaper_of(lambda f_d, _: Impulses([0.5, 0.5], [0.0, time(f_d)]), name="mine")
    for f_d in (0.5, 4.4, 100.0):
        tvist = make_filter(mine, Fixed([f_d], [0.1]), joints=1)
        assert tvist.delay == pytest.approx(time(f_d))
        tvist.filter([0.0])
        shaped = [float(tvist.filter([1.0])[0]) for _ in range(200)]
        assert (shaped[0], shaped[-1]) == (0.5, 1.0)
    with pytest.raises(ShapingError, match="times are in seconds"):
        make_filter(shaper_of(lambda f_d, _: zv(f_d / 1000.0, 0.1), name="ms"), Fixed([5.0], [0.1]), joints=1)


@pytest.mark.parametrize(("field", "declared"), [("duration_periods", 0.4), ("peak", 2.0)])
def test_shaper_beyond_its_declared_duration_or_peak_is_refused(field, declared):
    values = {"duration_periods": 0.5, "peak": 3.0} | {field: declared}
    mine = Shaper("mine", "", lambda f_d, _zeta: Impulses([2.0, -1.0], [0.0, 0.5 / f_d]), **values)
    with pytest.raises(ShaperFailureError, match=field):
        check_shaper(mine)


def turned(kind, name):
    """A filter whose function can be told to fail, and that function."""
    if kind == "taps":
        turning = Turning(lambda _f_d, _zeta: np.full(20, 0.05), WRONG_TAPS[name][0])
        return turning, FirShaper("mine", "", turning, taps=20)
    turning = Turning(fine, WRONG[name][0])
    return turning, Shaper("mine", "", turning, 0.5)


FAILURES = [*(("impulses", name) for name in WRONG), *(("taps", name) for name in WRONG_TAPS)]


@pytest.mark.parametrize(("kind", "name"), FAILURES)
def test_failing_filter_continues_with_its_last_weights_and_reports_why(kind, name):
    turning, mine = turned(kind, name)
    tvist, other = (make_filter(mine, Fixed([7.0], [0.1]), joints=1) for _ in range(2))
    right = shaped(other)
    first = shaped(tvist, REFERENCE[:200])
    assert tvist.fault is None
    turning.failing = True
    rest = shaped(tvist, REFERENCE[200:])
    np.testing.assert_array_equal([*first, *rest], right)  # modes that do not change: same weights
    assert (WRONG_TAPS if kind == "taps" else WRONG)[name][1] in tvist.fault
    assert "f_d = 7 Hz and ζ = 0.1" in tvist.fault
    turning.failing = False
    tvist.reset([0.0])
    assert tvist.fault is None
    np.testing.assert_array_equal(shaped(tvist), right)


@pytest.mark.parametrize("kind", ["impulses", "taps"])
def test_filter_that_fails_at_the_start_is_refused(kind):
    turning, mine = turned(kind, "raises")
    turning.failing = True
    with pytest.raises(ShaperFailureError, match="shaper 'mine' raises ZeroDivisionError"):
        make_filter(mine, Fixed([7.0], [0.1]), joints=1)


def test_impulses_beyond_the_declared_duration_are_not_used():
    turning = Turning(zv, lambda f_d, zeta: zv(0.5 * f_d, zeta))
    tvist = make_filter(Shaper("mine", "", turning, 0.5), Fixed([7.0], [0.1]), joints=1)
    turning.failing = True
    shaped(tvist)
    assert "last 0.142857 s, beyond 0.0714286 s" in tvist.fault
    assert tvist.impulses.duration == pytest.approx(0.5 / 7.0)


def test_failure_in_a_fork_leaves_the_filter_unchanged():
    turning, mine = turned("impulses", "raises")
    tvist = make_filter(mine, Fixed([7.0], [0.1]), joints=1)
    ahead = tvist.fork()
    turning.failing = True
    shaped(ahead)
    assert ahead.fault is not None
    assert tvist.fault is None


class TestRegistry:
    def test_own_shapers_are_listed_last_and_made_by_name(self):
        registry = Registry([shaper_of(zv, name="mine"), mean()])
        assert registry.names() == (*BUILT_IN.names(), "mine", "mean")
        assert registry.make_filter("mean", Fixed([7.0], [0.1]), joints=2).name == "mean"
        assert "mine" not in BUILT_IN.names()

    def test_modes_of_each_kind_of_filter(self):
        two = FirShaper("two", "", lambda _f_d, _zeta: [1.0], taps=1, modes=2)
        registry = Registry([shaper_of(zv, name="mine"), two])
        assert [registry.modes_of(name, 3) for name in ("zv", "mine", "two", "auto")] == [3, 3, 2, 4]

    @pytest.mark.parametrize("name", ["zv", "auto", "", "Mine", "mine.py:mine", "ζ", "x" * 65, None, 3])
    def test_invalid_or_taken_name_is_refused(self, name):
        with pytest.raises(DesignError, match="name is "):
            Registry([mean(name=name)])

    def test_fir_shaper_with_another_period_is_refused(self):
        with pytest.raises(DesignError, match=r"period is 0\.004"):
            Registry([FirShaper("mine", "", lambda _f_d, _zeta: [1.0], taps=1, period=0.004)])

    def test_two_shapers_of_one_name_are_refused(self):
        with pytest.raises(DesignError, match="must be a name that no other shaper has"):
            Registry([mean(), custom("mean", [1.0], [0.0])])

    def test_unknown_name_lists_own_shapers_too(self):
        with pytest.raises(UnknownShaperError, match=r"did you mean 'mean'.* elastic-position, mean"):
            Registry([mean()]).check("meen")
