import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_shaping import DelayError, DelayLine, ShapingError, shaper

ONE = np.array([1.0])
samples = st.lists(st.floats(-10.0, 10.0), min_size=25, max_size=60)


def filled(values, capacity=20):
    """A line of two joints, the second the first's negative, with the values pushed in order."""
    line = DelayLine(2, capacity)
    for x in values:
        line.push([x, -x])
    return line


def read(line, delay):
    out = np.zeros(2)
    line.gather(ONE, np.array([float(delay)]), out)
    return out


@given(samples, st.integers(0, 17))
def test_whole_delay_gives_the_sample_itself(values, delay):
    x, minus_x = read(filled(values), delay)
    assert x == values[-1 - delay]
    assert minus_x == -x


@given(st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), st.floats(0.0, 17.0))
def test_cubic_is_reproduced_exactly_at_any_delay(coefficients, delay):
    t = np.arange(-30.0, 1.0) / 10.0
    line = filled(np.polyval(coefficients, t))
    assert read(line, delay)[0] == pytest.approx(np.polyval(coefficients, -delay / 10.0), abs=1e-12)


@given(
    st.floats(-1e3, 1e3),
    st.sampled_from(["zv", "zvd", "ei", "mzv", "ei2", "ei3"]),
    st.floats(0.0, 0.99),
    st.floats(0.01, 8.0),
)
def test_constant_is_reproduced_bit_for_bit_at_any_delay(value, name, zeta, spacing):
    line = DelayLine(1, 20)
    line.fill([value])
    impulses = shaper(name).function(1.0, zeta)
    out = np.zeros(1)
    line.gather(impulses.A, impulses.tau * spacing, out)
    assert out[0] == value


@given(samples, st.floats(0.0, 17.0), st.floats(0.0, 0.99))
def test_fractional_delay_overshoots_no_more_than_a_cubic_can(values, delay, zeta):
    line = filled(values)
    A = shaper("zv").function(1.0, zeta).A
    out = np.zeros(2)
    line.gather(A, np.array([0.0, delay]), out)
    held = values[-20:]
    allowed = (1.0 / 8.0 if delay >= 1.0 else 1.0 / 3.0) * (max(held) - min(held)) + 1e-12
    assert min(held) - allowed <= out[0] <= max(held) + allowed


def test_weights_between_two_ticks_are_those_of_the_cubic_through_the_four_nearest_samples():
    weights = [read(filled(one), 10.5)[0] for one in np.eye(20)]
    np.testing.assert_allclose(weights, np.pad([-1.0, 9.0, 9.0, -1.0], (7, 9)) / 16.0, atol=1e-15)


@pytest.mark.parametrize("delay", [-1e-9, 17.0000001, 1e300, math.nan, math.inf])
def test_delay_beyond_the_line_is_refused_without_output(delay):
    line = filled(np.arange(30.0))
    out = np.full(2, 5.0)
    with pytest.raises(DelayError, match="must be 0 to 17 ticks") as error:
        line.gather(np.array([0.5, 0.5]), np.array([0.0, delay]), out)
    assert error.value.delay == pytest.approx(delay, nan_ok=True)
    assert error.value.limit == line.max_delay == 17
    assert (out == 5.0).all()


@pytest.mark.parametrize(
    ("size", "said"),
    [((0, 10), "joints is 0: must be at least 1"), ((1, 3), "capacity is 3: must be at least 4")],
)
def test_line_too_short_to_interpolate_is_refused(size, said):
    with pytest.raises(ShapingError, match=said):
        DelayLine(*size)
