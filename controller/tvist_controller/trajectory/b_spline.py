"""Uniform B-splines, whose curves keep the limits that their control points keep."""

from collections.abc import Sequence

from tvist_controller.trajectory.limits import Floats


def linear(points: Sequence[Floats], u: float) -> tuple[Floats, Floats]:
    """Interpolate linearly between the last two points; the slope is that of the parabola through the last three.

    Args:
        points: The last four points, each of shape (n,).
        u: Position between the last two points, 0 < u ≤ 1; at 1 the value is exactly the last point [-].

    Returns:
        Value, and derivative with respect to u.
    """
    before, last = points[2] - points[1], points[3] - points[2]
    value = points[3] if u == 1.0 else points[2] + u * last
    return value, last + (u - 0.5) * (last - before)


def cubic(points: Sequence[Floats], u: float) -> tuple[Floats, Floats]:
    """Evaluate the uniform cubic B-spline between the middle two of four points.

    Its second derivative varies linearly from one second difference of the points to the next, and its third
    derivative is their third difference, so it keeps the points' limits of velocity, acceleration and jerk. The curve
    passes the points at a distance of q''/6, on the inside of the bend (de Boor 1978, ch. IX to XI).

    Args:
        points: Four points, each of shape (n,).
        u: Position between the second and the third point, 0 < u ≤ 1 [-].

    Returns:
        Value, and derivative with respect to u.
    """
    first, middle, last = points[1] - points[0], points[2] - points[1], points[3] - points[2]
    v = 1.0 - u
    # Use differences, so that equal points give exactly their own value.
    inner = (1.0 + u * (3.0 + u * (3.0 - 2.0 * u))) / 6.0
    value = points[1] - (v**3 / 6.0) * first + inner * middle + (u**3 / 6.0) * last
    return value, 0.5 * v * v * first + (0.5 + u * v) * middle + 0.5 * u * u * last
