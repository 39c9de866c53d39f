"""Uniform B-splines, whose curves keep the limits that their control points keep."""

from collections.abc import Sequence

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.trajectory.limits import Floats


def linear(
    points: Sequence[Floats],  # the last four, each of shape (n,)
    u: float,  # place between the last two, 0 < u ≤ 1; at 1 the value is exactly the last point [-]
    rate: float,  # of u [1/s]
) -> tuple[Floats, Floats, float]:
    """Interpolate linearly between the last two points; the slope is that of the parabola through the last three.

    Returns the value, its derivative with respect to time, and the largest absolute value of that.
    """
    found = np.empty((2, len(points[0])))
    fastest = on_parabola(points[1], points[2], points[3], u, rate, found)
    return found[0], found[1], fastest


def cubic(points: Sequence[Floats], u: float, rate: float) -> tuple[Floats, Floats, float]:
    """Evaluate the uniform cubic B-spline between the middle two of four points; see `linear`.

    Its second derivative varies linearly from one second difference of the points to the next, and its third
    derivative is their third difference, so it keeps the points' limits of velocity, acceleration and jerk. The curve
    passes the points at a distance of q''/6, on the inside of the bend (de Boor 1978, ch. IX to XI).
    """
    v = 1.0 - u
    found = np.empty((2, len(points[0])))
    inner = (1.0 + u * (3.0 + u * (3.0 - 2.0 * u))) / 6.0
    values, slopes = (v**3 / 6.0, inner, u**3 / 6.0), (0.5 * v * v, 0.5 + u * v, 0.5 * u * u)
    fastest = on_cubic(points[0], points[1], points[2], points[3], values, slopes, rate, found)
    return found[0], found[1], fastest


@compiled_for_ticks
def on_parabola(before: Floats, middle: Floats, last: Floats, u: float, rate: float, found: Floats) -> float:
    """Compute what `linear` returns: value and derivative, shape (2, n), and the largest derivative."""
    fastest = 0.0
    for j in range(last.shape[0]):
        fall, rise = middle[j] - before[j], last[j] - middle[j]
        found[0, j] = last[j] if u == 1.0 else middle[j] + u * rise
        found[1, j] = rate * (rise + (u - 0.5) * (rise - fall))
        fastest = max(fastest, abs(found[1, j]))
    return fastest


@compiled_for_ticks
def on_cubic(
    first: Floats,
    second: Floats,
    third: Floats,
    fourth: Floats,
    values: tuple[float, float, float],
    slopes: tuple[float, float, float],
    rate: float,
    found: Floats,
) -> float:
    """Compute what `cubic` returns, as `on_parabola`, from the weights of the points' differences."""
    fastest = 0.0
    for j in range(first.shape[0]):
        # Use differences, so that equal points give exactly their own value.
        a, b, c = second[j] - first[j], third[j] - second[j], fourth[j] - third[j]
        found[0, j] = second[j] - values[0] * a + values[1] * b + values[2] * c
        found[1, j] = rate * (slopes[0] * a + slopes[1] * b + slopes[2] * c)
        fastest = max(fastest, abs(found[1, j]))
    return fastest
