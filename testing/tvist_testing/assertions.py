"""Assertions on how a robot moved; they advance time if they need to see more, and fail with a small table.

Times count from the tick in which the shaped reference came to rest, when a motion is reported as done.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_testing.fixture_robot import FixtureRobot
    from tvist_testing.history import HistoryRow

BAND = 1e-4  # distance from its final position within which the tool counts as settled [m]
WINDOW = 0.3  # time after the stop in which residual vibration is measured [s]
BEYOND = 0.5  # time for which a robot is observed after the permitted time [s]
TAIL = 0.2  # time at the end of the observed rest whose mean position is the final position [s]
AFTER_STOP = 0.01  # time after the stop in which the end of the deceleration still counts as motion [s]


def assert_settles_within(robot: "FixtureRobot", seconds: float, *, band: float = BAND) -> float:
    """Assert that the tool settles in time; return the time that it took [s].

    A running motion is awaited first. The tool is the flange of the flexible arm, as the simulation knows it.

    Args:
        robot: Robot of `tvist_robot`, `tvist_robots` or `tvist_ur`.
        seconds: Largest time from the stop of the shaped reference until the tool stays within the band [s].
        band: Distance from the final position, which is the mean of the last 0.2 s observed [m].

    Raises:
        AssertionError: It takes longer, or the robot has not moved; the message has a table.
        ValueError: `seconds` is less than 0, or `band` is not more than 0.
    """
    __tracebackhide__ = True
    _check("seconds", seconds, least=0.0)
    _check("band", band, least=math.ulp(0.0))
    rows = _at_rest(robot, seconds + BEYOND)
    settled, farthest = settling(rows, band)
    if settled <= seconds:
        return settled
    took = f"{settled:.3f}" if settled < math.inf else f"more than {rows[-1].time - rows[0].time:.3f}"
    _, late = settling([row for row in rows if row.time - rows[0].time >= seconds], band)
    raise AssertionError(
        f"the tool of {robot.name} does not settle within {seconds:g} s\n"
        + table(
            ("after the stop", "measured", "limit"),
            [
                ("settling time [s]", took, f"{seconds:g}"),
                ("distance at the stop [mm]", figure(1e3 * farthest), ""),
                (f"distance after {seconds:g} s [mm]", figure(1e3 * late), f"{1e3 * band:g}"),
                ("tick of the stop", str(rows[0].tick), ""),
            ],
        )
    )


def assert_residual_vibration_below(robot: "FixtureRobot", limit: float, *, window: float = WINDOW) -> float:
    """Assert that the tool hardly vibrates after a motion; return the residual vibration [m/s²].

    It is the largest acceleration of the flange, without gravity and noise, from 10 ms after the stop of the
    shaped reference to the end of the window. A running motion is awaited first.

    Args:
        robot: Robot of `tvist_robot`, `tvist_robots` or `tvist_ur`.
        limit: Largest residual vibration [m/s²].
        window: Duration of the window [s].

    Raises:
        AssertionError: The tool vibrates more, or the robot has not moved; the message has a table.
        ValueError: `limit` is less than 0, or `window` is not more than 0.02 s.
    """
    __tracebackhide__ = True
    _check("limit", limit, least=0.0)
    _check("window", window, least=0.02)
    alpha = vibration(_at_rest(robot, window), window)
    value = max(amplitude for _, amplitude in alpha)
    if value <= limit:
        return value
    peaks = []
    for first, past in ((third * window / 3, (third + 1) * window / 3) for third in range(3)):
        peak = max(a for t, a in alpha if first <= t <= past + 1e-9)
        peaks.append((f"{first:.2f} to {past:.2f} s", figure(peak), f"{limit:g}"))
    raise AssertionError(
        f"the residual vibration of {robot.name} is {value:.3g} m/s², above {limit:g} m/s²\n"
        + table(("after the stop", "largest |α| [m/s²]", "limit"), peaks)
    )


def assert_within_limits(
    robot: "FixtureRobot",
    *,
    speed: float | Sequence[float] | None = None,
    acceleration: float | Sequence[float] | None = None,
    torque: float | Sequence[float] | None = None,
    tool_speed: float | None = None,
) -> None:
    """Assert that no joint, nor the tool if `tool_speed` is given, has exceeded its limits since the test began.

    Measured angles, velocities and torques and the accelerations of the shaped reference are checked, for the
    last ten minutes of simulation at most.

    Args:
        robot: Robot of `tvist_robot`, `tvist_robots` or `tvist_ur`.
        speed: Largest speed of all joints or of each [rad/s]; by default the robot's own limits.
        acceleration: Largest acceleration [rad/s²], likewise.
        torque: Largest torque [N m], likewise.
        tool_speed: Largest speed of the tool centre point [m/s]; by default it has no limit.

    Raises:
        AssertionError: A limit was exceeded (the message has a table), or no time has passed.
        ValueError: A limit is not positive, or there is not one for each joint.
    """
    __tracebackhide__ = True
    own = robot.history.joint_limits
    assert own is not None
    rules = [
        ("speed [rad/s]", "qd", _each("speed", speed, own.velocity)),
        ("acceleration [rad/s²]", "qdd", _each("acceleration", acceleration, own.acceleration)),
        ("torque [N m]", "moment", _each("torque", torque, own.torque)),
    ]
    if tool_speed is not None:
        _check("tool_speed", tool_speed, least=math.ulp(0.0))
    rows = tuple(robot.history.rows)
    if not rows:
        raise AssertionError(f"no time has passed for {robot.name}, so there is nothing to check")
    beyond: list[tuple[str, str, str, str]] = []
    for joint, (low, high) in enumerate(own.position):
        for row in (min(rows, key=lambda one: one.q[joint]), max(rows, key=lambda one: one.q[joint])):
            if not low <= row.q[joint] <= high:
                bounds = f"{figure(low)} to {figure(high)}"
                beyond.append(
                    (f"joint {joint}: angle [rad]", figure(row.q[joint]), bounds, f"{row.time:.3f}")
                )
        for what, quantity, limits in rules:
            values = [abs(getattr(row, quantity)[joint]) for row in rows]
            if (value := max(values)) > limits[joint]:
                at = rows[values.index(value)].time
                beyond.append((f"joint {joint}: {what}", figure(value), figure(limits[joint]), f"{at:.3f}"))
    speeds = [math.hypot(*row.tool_speed[:3]) for row in rows]
    if tool_speed is not None and (fastest := max(speeds)) > tool_speed:
        at = rows[speeds.index(fastest)].time
        beyond.append(("tool: speed [m/s]", figure(fastest), figure(tool_speed), f"{at:.3f}"))
    if beyond:
        raise AssertionError(
            f"{robot.name} was beyond its limits\n" + table(("what", "largest", "limit", "at [s]"), beyond)
        )


def _at_rest(robot: "FixtureRobot", seconds: float) -> "list[HistoryRow]":
    """Wait for the shaped reference's rest, then until `seconds` have passed since; return the rows since then."""
    __tracebackhide__ = True
    robot.rest()
    history = robot.history
    if not any(row.moving for row in history.rows):
        raise AssertionError(f"{robot.name} has not moved, so there is nothing to check")
    rows = history.since_rest()
    seen = rows[-1].time - rows[0].time if rows else 0.0
    if (ticks := math.ceil((seconds - seen) / history.period - 1e-6)) > 0:
        robot.advance(ticks)
        robot.info()  # answered after everything published before, such as the last tick's truth
    return history.since_rest()


def _check(name: str, value: float, least: float) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < math.inf:
        needed = "more than 0" if least == math.ulp(0.0) else f"at least {least:g}"
        raise ValueError(f"{name} is {value!r}: must be a number, {needed}")


def _each(name: str, given: float | Sequence[float] | None, own: Sequence[float]) -> Sequence[float]:
    if given is None:
        return own
    limits = [float(given)] * len(own) if isinstance(given, int | float) else [float(one) for one in given]
    if len(limits) != len(own):
        raise ValueError(
            f"{name} has {len(limits)} limits: must be one number, or one for each of {len(own)} joints"
        )
    for limit in limits:
        _check(name, limit, least=math.ulp(0.0))
    return limits


def settling(rows: "Sequence[HistoryRow]", band: float) -> tuple[float, float]:
    """Return when the flexible arm's flange has settled within `band` [m], and its largest distance.

    The time counts from the stop [s], and is infinite if the flange did not settle while observed; the
    distance [m] is from its final position. `rows` start at the stop of the reference and last longer than
    `TAIL`.
    """
    stop, end = rows[0].time, rows[-1].time
    tail = [row.pose for row in rows if row.time > end - TAIL]
    attained = [math.fsum(pose[axis] for pose in tail) / len(tail) for axis in range(3)]
    distances = [(math.dist(row.pose[:3], attained), row.time) for row in rows]
    last = max((time for distance, time in distances if distance > band), default=stop)
    return last - stop if last <= end - TAIL else math.inf, max(distances)[0]


def vibration(rows: "Sequence[HistoryRow]", until: float) -> list[tuple[float, float]]:
    """Return time [s] and |α| [m/s²] of each tick from 10 ms after the stop to the time `until` after it [s].

    `rows` start at the stop of the reference.
    """
    from tvist_plant.tool_acceleration import tool_acceleration, upward  # imported only if needed

    stop, slack = rows[0].time, 1e-9
    late = [row for row in rows if AFTER_STOP + slack < row.time - stop <= until + slack]
    forces = [tool_acceleration(row.acceleration, upward(row.pose[3:6])) for row in late]
    return [(row.time - stop, math.hypot(*force)) for row, force in zip(late, forces, strict=True)]


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table with aligned columns: the first one to the left, the others to the right."""
    first, *others = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    lines = [heads, ["-" * width for width in (first, *others)], *rows]
    padded = [[head.ljust(first), *map(str.rjust, cells, others)] for head, *cells in lines]
    return "\n".join(f"  {'  '.join(cells)}".rstrip() for cells in padded)


def figure(value: float) -> str:
    """Return a number with four significant digits."""
    return f"{value:.4g}"
