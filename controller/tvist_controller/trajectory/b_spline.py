"""Uniform B-splines: curves that keep the limits of the points they are made of."""

from collections.abc import Sequence

from tvist_controller.trajectory.limits import Floats


def linear(points: Sequence[Floats], u: float) -> tuple[Floats, Floats]:
    """The straight line between the last two points; the slope is that of the parabola through the last three.

    Args:
        points: The last four, each of shape (n,).
        u: Place between the last two, 0 < u ≤ 1; at 1 it is the last one to the bit [-].

    Returns:
        Value, and derivative by u.
    """
    before, last = points[2] - points[1], points[3] - points[2]
    value = points[3] if u == 1.0 else points[2] + u * last
    return value, last + (u - 0.5) * (last - before)


def cubic(points: Sequence[Floats], u: float) -> tuple[Floats, Floats]:
    """The uniform cubic B-spline between the middle two of four points.

    Its second derivative goes linearly from one second difference of the points to the next, and its third is
    their third difference: a motion within limits of velocity, acceleration and jerk stays within. It passes the
    points at the distance q''/6 towards the inside of the curve (de Boor 1978, ch. IX to XI).

    Args:
        points: Four, each of shape (n,).
        u: Place between the second and the third, 0 < u ≤ 1 [-].

    Returns:
        Value, and derivative by u.
    """
    first, middle, last = points[1] - points[0], points[2] - points[1], points[3] - points[2]
    v = 1.0 - u
    # By differences, so that equal points give their own value to the bit.
    inner = (1.0 + u * (3.0 + u * (3.0 - 2.0 * u))) / 6.0
    value = points[1] - (v**3 / 6.0) * first + inner * middle + (u**3 / 6.0) * last
    return value, 0.5 * v * v * first + (0.5 + u * v) * middle + 0.5 * u * u * last
