import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tvist_shaping import (
    SHAPERS,
    Fixed,
    ImpulseError,
    Impulses,
    ShaperRangeError,
    ShapingError,
    TvistFilter,
    UnknownShaperError,
    band,
    product,
    residual,
    shaper,
    um_zv,
    um_zvd,
    zv,
    zvd,
)
from tvist_shaping.errors import DesignError
from tvist_shaping.named import BUILT_IN, SMOOTHINGS, make_filter

from .motions import H, amplitude, oscillation_left, shaped_by

frequencies = st.floats(1e-6, 1e6)
shares = st.floats(0.0, 1.0, exclude_max=True)
shapers = st.sampled_from(list(SHAPERS.values()))


def test_amplitudes_and_times_match_the_golden_values(golden):
    for entry in golden["shapers"]:
        impulses = SHAPERS[entry["name"]].function(entry["f_d"], entry["zeta"])
        np.testing.assert_allclose(impulses.A, entry["A"], rtol=0, atol=1e-6, err_msg=str(entry))
        np.testing.assert_allclose(impulses.tau, entry["tau"], rtol=0, atol=1e-6, err_msg=str(entry))


@given(shapers, frequencies, shares)
def test_every_shaper_gives_valid_impulses_within_its_catalogue_duration(shaper, f_d, share):
    impulses = shaper.function(f_d, share * shaper.zeta_max)
    checked = Impulses(impulses.A, impulses.tau)
    assert abs(checked.A.sum() - 1.0) < 1e-14
    assert np.abs(checked.A).sum() <= shaper.peak + 1e-12
    assert impulses.duration <= shaper.duration_periods / f_d * (1 + 1e-8)


@pytest.mark.parametrize("name", SHAPERS)
def test_catalogue_duration_is_reached(name):
    entry = SHAPERS[name]
    longest = max(entry.function(1.0, share * entry.zeta_max).duration for share in (0.0, 1.0 - 1e-9))
    assert longest == pytest.approx(entry.duration_periods, rel=1e-8)


@pytest.mark.parametrize("name", SHAPERS)
def test_mode_out_of_range_is_refused_with_value_and_limit(name):
    entry = SHAPERS[name]
    for f_d in (0.0, -1.0, math.nan, math.inf, 1e-7, 1e7):
        with pytest.raises(ShaperRangeError) as error:
            entry.function(f_d, 0.1)
        assert (error.value.field, "1e-06" in error.value.limit) == ("f_d", True)
        assert error.value.value == pytest.approx(f_d, nan_ok=True)
    for zeta in (-0.01, 1.0, 2.0, math.nan, math.inf):
        with pytest.raises(ShaperRangeError) as error:
            entry.function(10.0, zeta)
        assert (error.value.field, f"less than {entry.zeta_max:g}" in error.value.limit) == ("zeta", True)
        assert error.value.value == pytest.approx(zeta, nan_ok=True)


@pytest.mark.parametrize("name", [name for name, entry in SHAPERS.items() if entry.zeta_max < 1.0])
def test_damping_above_zeta_max_is_refused_with_an_alternative(name):
    entry = SHAPERS[name]
    entry.function(10.0, entry.zeta_max * (1 - 1e-12))
    with pytest.raises(ShaperRangeError, match=r"beyond it take (ei|zv)"):
        entry.function(10.0, entry.zeta_max)


@pytest.mark.parametrize(("A", "tau", "why"), [
    ([0.5, 0.5], [0.0], "shape"), ([], [], "shape"), ([[1.0]], [[0.0]], "shape"),
    ([0.5, math.nan], [0.0, 1.0], "A is .* finite"), ([0.5, 0.5], [0.0, math.inf], "tau is .* finite"),
    ([0.5, 0.5], [0.1, 1.0], "ascend from 0"), ([0.4, 0.3, 0.3], [0.0, 1.0, 0.5], "ascend from 0"),
    ([0.5, 0.5 + 2e-9], [0.0, 1.0], "must be 1 within"),
])  # fmt: skip
def test_invalid_impulses_are_refused(A, tau, why):
    with pytest.raises(ImpulseError, match=why):
        Impulses(A, tau)


def test_impulses_are_read_only_copies():
    A = np.array([0.5, 0.5])
    made = Impulses(A, [0.0, 1.0])
    A[0] = 7.0
    assert made.A[0] == 0.5
    for train in (made, zv(10.0, 0.1), product([zv(10.0, 0.1), zvd(7.0, 0.2)])):
        for values in (train.A, train.tau):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 1.0
        with pytest.raises(AttributeError):
            train.A = A


def test_product_is_the_convolution_of_the_trains():
    three = product([zv(7.0, 0.3), zvd(7.0, 0.3), zv(19.0, 0.1)])
    Impulses(three.A, three.tau)
    assert three.A.size == 12
    f = np.linspace(0.0, 40.0, 50)

    def spectrum(train):
        return np.exp(-2j * np.pi * f[:, None] * train.tau) @ train.A

    factors = spectrum(zv(7.0, 0.3)) * spectrum(zvd(7.0, 0.3)) * spectrum(zv(19.0, 0.1))
    np.testing.assert_allclose(spectrum(three), factors, atol=1e-14)


def test_catalogue_is_sorted_by_duration():
    durations = [entry.duration_periods for entry in SHAPERS.values()]
    assert durations == sorted(durations)


def test_unknown_shaper_lists_all_names_and_the_nearest():
    with pytest.raises(UnknownShaperError, match=r"did you mean 'zvddd'.*there are none, um_zv, zv") as error:
        shaper("zvdddd")
    assert error.value.name == "zvdddd"
    assert error.value.known == tuple(SHAPERS)
    assert error.value.nearest == "zvddd"


def test_sensitivity_matches_figure_4_of_the_paper(golden):
    for name, row in golden["sensitivity_undamped_10_5_hz"].items():
        f = np.array([float(f) for f in row])
        percent = 100.0 * residual(f, 0.0, SHAPERS[name].function(10.5, 0.0))
        np.testing.assert_allclose(percent, list(row.values()), rtol=0, atol=0.00501, err_msg=name)


@pytest.mark.parametrize("name", ["zv", "mzv", "zvd", "ei", "zvdd", "ei2", "zvddd", "ei3"])
@pytest.mark.parametrize("percent", [5, 10])
def test_bands_match_the_golden_table(name, percent, golden):
    low, high = golden["bands_undamped"][name][str(percent)]
    impulses = SHAPERS[name].function(8.0, 0.0)
    assert band(impulses, 8.0, 0.0, percent / 100) == pytest.approx((8.0 * low, 8.0 * high), abs=1e-3)
    assert SHAPERS[name].band(percent / 100) == pytest.approx((low, high), abs=1e-4)


def test_invalid_arguments_of_residual_and_band_are_refused_by_name():
    train = zv(1.0, 0.0)
    for f in (-1.0, math.nan, math.inf):
        with pytest.raises(ShaperRangeError, match="f is"):
            residual(f, 0.0, train)
        with pytest.raises(ShaperRangeError, match="f_d is"):
            band(train, f, 0.0, 0.05)
    for zeta in (-0.1, 1.0, math.nan):
        with pytest.raises(ShaperRangeError, match="zeta is"):
            residual(1.0, zeta, train)
    for V in (0.0, 1.0, math.nan):
        with pytest.raises(ShapingError, match="V is"):
            band(train, 1.0, 0.0, V)


ZERO_AT_THE_DESIGN = ["zv", "mzv", "zvd", "zvdd", "zvddd", "ei2", "ei2_exact", "um_zv", "um_zvd"]
MODES = [
    (6.7, 0.34), (15.0, 0.14), (10.5, 0.0), (10.0, 0.1), (8.0, 0.19), (7.0, 0.3), (9.0, 0.48), (3.0, 0.7),
]  # fmt: skip


def amplitude_after_steps(impulses, f_d, zeta):
    """Amplitude left by a step of r at each impulse, by the exponential of ẍ = ω_n²(r - x) - 2ζω_n ẋ."""
    omega_n = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    system = np.array([[0.0, 1.0], [-(omega_n**2), -2.0 * zeta * omega_n]])
    state, reference = np.zeros(2), 0.0
    for A, wait in zip(impulses.A, np.append(np.diff(impulses.tau), 0.0), strict=True):
        reference += A
        rest = np.array([reference, 0.0])
        state = rest + expm(system * wait) @ (state - rest)
    return amplitude(state[0] - 1.0, state[1], f_d, zeta)


def valid(names):
    """Each with every mode that it is for."""
    return [(name, *mode) for name in names for mode in MODES if mode[1] < SHAPERS[name].zeta_max]


@pytest.mark.parametrize(("name", "f_d", "zeta"), valid(ZERO_AT_THE_DESIGN))
def test_shaped_step_leaves_the_designed_mode_at_rest(name, f_d, zeta):
    impulses = SHAPERS[name].function(f_d, zeta)
    limit = 1e-7 if name == "ei2_exact" else 1e-9
    assert residual(f_d, zeta, impulses) < limit
    assert amplitude_after_steps(impulses, f_d, zeta) < limit


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize(("f", "zeta"), [(5.0, 0.0), (7.1, 0.2), (14.0, 0.14), (9.0, 0.6)])
def test_residual_is_the_amplitude_of_a_simulated_oscillator(name, f, zeta):
    impulses = SHAPERS[name].function(9.0, 0.1)
    one_step = amplitude_after_steps(SHAPERS["none"].function(f, zeta), f, zeta)
    left = residual(f, zeta, impulses) * one_step
    assert amplitude_after_steps(impulses, f, zeta) == pytest.approx(left, abs=1e-9)


@pytest.mark.parametrize("name", [name for name in ZERO_AT_THE_DESIGN if SHAPERS[name].peak == 1.0])
@pytest.mark.parametrize(("f_d", "zeta"), [(6.7, 0.02), (15.0, 0.14), (7.93, 0.05)])
def test_sampled_filter_brings_an_oscillator_to_rest(name, f_d, zeta):
    t = np.clip(H * np.arange(500) / 0.1, 0.0, 1.0)  # a motion of 0.1 s: about a period, it rings
    reference = t**4 * (35.0 - 84.0 * t + 70.0 * t**2 - 20.0 * t**3)
    tvist = TvistFilter(shaper(name), Fixed([f_d], [zeta]), joints=1, period=H)
    shaped = shaped_by(tvist, reference[:, None])[:, 0]
    end = int(np.ceil((0.1 + tvist.delay) / H)) + 2
    assert shaped[end] == 1.0
    left, unshaped = (oscillation_left(one, f_d, zeta) for one in (shaped[: end + 1], reference[:51]))
    assert left < 1e-4 * unshaped


def test_unity_magnitude_times_match_the_golden_values(golden):
    for entry in golden["um_zv"]:
        zeta = entry["zeta"]
        in_undamped_periods = um_zv(1.0, zeta).tau / math.sqrt(1.0 - zeta**2)
        np.testing.assert_allclose(in_undamped_periods, entry["undamped_periods"], atol=6e-6)
    np.testing.assert_allclose(um_zvd(1.0, 0.0).tau, [0.0, 0.08951, 0.36623, 0.64296, 0.73247], atol=6e-6)


@given(st.floats(0.0, 0.4999), st.floats(0.5, 50.0))
def test_unity_magnitude_shapers_leave_no_vibration_at_the_design(zeta, f_d):
    one, two = um_zv(f_d, zeta), um_zvd(f_d, zeta)
    assert residual(f_d, zeta, one) < 1e-9
    assert residual(f_d, zeta, two) < 1e-9
    near = f_d * (1.0 + 1e-4 * np.array([-1.0, 1.0]))
    slope, none = (residual(near, zeta, train) / 1e-4 for train in (one, two))
    assert slope.min() > 0.5
    assert none.max() < 0.1


@pytest.mark.parametrize("name", ["um_zv", "um_zvd", "zv", "ei3"])
def test_catalogue_peak_bounds_the_shaped_acceleration_and_is_reached(name):
    tvist = TvistFilter(shaper(name), Fixed([2.0], [0.0]), joints=1)
    # The acceleration turns round with the impulses: the worst there is.
    impulses = tvist.impulses
    t = 0.002 * np.arange(1500)
    end = 2.0 + impulses.duration
    acceleration = np.zeros(t.size)
    for A, tau in zip(impulses.A, impulses.tau, strict=True):
        late = np.clip((t - (end - tau)) / 0.02, -1.0, 1.0)
        acceleration += np.sign(A) * np.cos(0.5 * np.pi * late) ** 2
    reference = np.cumsum(np.cumsum(acceleration)) * 0.002**2
    shaped = np.array([tvist.filter([x])[0] for x in reference])
    peak = np.abs(np.diff(shaped, 2)).max() / 0.002**2
    assert peak <= SHAPERS[name].peak * 1.01
    assert peak >= SHAPERS[name].peak * 0.95


MODE = Fixed([10.0], [0.1])


@pytest.mark.parametrize("kind", ["elastic", "elastic-position"])
@pytest.mark.parametrize("length", SMOOTHINGS)
def test_smoothing_length_is_taken_from_the_name(kind, length):
    smooth = make_filter(f"{kind}-{length}", MODE, joints=1)
    assert (smooth.name, smooth.feed_forward) == (f"{kind}-{length}", kind)
    assert smooth.delay == pytest.approx(length / 1000.0)
    weights = smooth.filter_all(np.eye(1, length // 2 + 1).T)
    assert weights.sum() == pytest.approx(1.0)
    assert (weights > 0.0).all()
    assert weights == pytest.approx(weights[::-1])


def test_smoothing_without_a_length_takes_40_ms():
    reference = np.cumsum(np.random.default_rng(1).normal(size=(200, 1)), axis=0)
    short, long = (make_filter(name, MODE, joints=1) for name in ("elastic", "elastic-40"))
    assert np.array_equal(short.filter_all(reference), long.filter_all(reference))


@pytest.mark.parametrize("name", ["elastic-7", "elastic-6", "elastic-62", "elastic-position-9", "elastic-0"])
def test_unsupported_smoothing_length_is_refused_with_the_range(name):
    with pytest.raises(DesignError, match=r"even, from 8 to 60 ms, as in elastic(-position)?-16"):
        BUILT_IN.check(name)


@pytest.mark.parametrize("name", [
    "elastic-", "elastic-x", "elastic-16-16", "auto-16", "zv-16", "elastic-016", "elastic-\uff11\uff16",
    f"elastic-{'9' * 5000}",
])  # fmt: skip
def test_malformed_smoothing_name_is_unknown(name):
    with pytest.raises(UnknownShaperError):
        BUILT_IN.check(name)
