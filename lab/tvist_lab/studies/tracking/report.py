"""Results of `tvist study tracking`, as JSON has them, and as tables of a page."""

from collections.abc import Mapping, Sequence
from typing import Any

from tvist_lab.markdown_table import markdown_table
from tvist_lab.studies.tracking.study import UNSHAPED, Tracked, speed_at
from tvist_lab.studies.tracking.ways import APPROACH, CONSTANT, DISTANCE, RAMP, WayName

TITLES: Mapping[WayName, str] = {
    "ramp": f"first joint alone, speeding up and slowing down with {RAMP:g} rad/s²",
    "turn": "all joints by 1 rad at once from the start posture, the velocity jumps",
    "jump": "test_trajectory_scaled: all joints at once, the velocity jumps",
}
"""Titles of the tables."""


def report(tracked: Sequence[Tracked], tolerance: float) -> list[dict[str, Any]]:
    """Return a map for each shaper, in the order in which they come.

    Args:
        tracked: Results of all jobs; for each shaper and trajectory at increasing speeds.
        tolerance: Path tolerance [rad].
    """
    ways: dict[str, dict[WayName, list[Tracked]]] = {}
    for one in tracked:
        ways.setdefault(one.shaper, {}).setdefault(one.way, []).append(one)
    return [
        {"name": name, "shaped": name != UNSHAPED}
        | {way: _figures(group, tolerance) for way, group in groups.items()}
        for name, groups in ways.items()
    ]


def _figures(group: list[Tracked], tolerance: float) -> dict[str, Any]:
    fastest = group[-1]
    found: dict[str, Any] = {
        "error_rad": [one.error for one in group],
        "within": [one.within(tolerance) for one in group],
        "speed_at_tolerance_rad_s": speed_at(tolerance, group),
    }
    if fastest.lag is not None:
        found |= {"lag_ms": 1e3 * fastest.lag, "mean_delay_ms": 1e3 * fastest.mean_delay}
    return found


def columns(result: dict[str, Any], way: WayName) -> list[str]:
    """Columns of the table of a trajectory."""
    speeds = [f"{speed:g} rad/s" for speed in result["speeds_rad_s"]]
    first = ["shaper", "mean delay ms", "lag ms"] if way == "ramp" else ["shaper"]
    return [*first, *speeds, f"{result['tolerance_rad']:g} rad at"]


def rows(result: dict[str, Any], way: WayName) -> list[list[str]]:
    """Rows of the table of a trajectory: largest errors [rad], those beyond the tolerance in asterisks."""
    return [_row(result, shaper, way) for shaper in result["shapers"]]


def _row(result: dict[str, Any], shaper: dict[str, Any], way: WayName) -> list[str]:
    found = shaper[way]
    errors = [
        f"{error:.3f}" if within else f"**{error:.3f}**"
        for error, within in zip(found["error_rad"], found["within"], strict=True)
    ]
    reached, most = found["speed_at_tolerance_rad_s"], result["speeds_rad_s"][-1]
    limit = f"> {most:g} rad/s" if reached is None else f"{reached:.2f} rad/s"
    times = [f"{found[key]:.1f}" for key in ("mean_delay_ms", "lag_ms")] if way == "ramp" else []
    return [shaper["name"] if shaper["shaped"] else "not shaped", *times, *errors, limit]


def page(result: dict[str, Any]) -> str:
    """Return a page with the tables and what they mean."""
    near, ahead, gain = result["tolerance_rad"], result["lookahead_s"], result["gain"]
    payload = result["payload_kg"]
    lag = result["shapers"][0]["ramp"]["lag_ms"]
    refused = [f"- `{name}`: {why}" for name, why in result["refused"].items()]
    left_out = ["", "## Left out", "", "The robot refuses these shapers:", "", *refused] if refused else []
    return f"""# Tracking of servoj

How closely does the arm follow a client that sends joint positions 500 times a second, such as the
`joint_trajectory_controller` of the [ROS 2 driver](../how-to/use-the-ros2-driver.md)? And what does it cost to
shape these motions? This command made the page:

```sh
{result["command"]}
```

The robot is that of `tvist serve --ur`, in lockstep and without a network, with a payload of {payload:g} kg.
A program like that of UR's client library takes the positions in one thread, and passes the latest ones to
`servoj(q, t={result["step_s"]:g}, lookahead_time={ahead:g}, gain={gain:g})` in another. After each tick, the client
compares `actual_q` with the positions wanted at that time, and sends those wanted one tick later. They arrive in time
for that tick. Each tick that a network needs on top of that adds 2 ms to the lag. The driver's controller gives up
with `PATH_TOLERANCE_VIOLATED` when a joint is more than {near:g} rad away.

The tables show the largest difference between wanted and actual position, over joints and time, in rad. Errors above
{near:g} rad are in bold. The last column is the speed at which the error reaches {near:g} rad, interpolated between the
measured speeds. The row *not shaped* is the robot without `--shape-servo`. There, `servoj` bypasses the shaper, so this
row belongs to every shaper. The other rows are measured with `--shape-servo`.

## A motion that the arm can make

The first joint alone speeds up with {RAMP:g} rad/s², keeps its speed for {CONSTANT:g} s, and slows down likewise. *Lag*
is the error at constant speed divided by the speed. It is the lag of `servoj` plus the mean delay of the shaper.
`auto`, `short`, `auto-target` and `elastic-auto` know the modes with any payload, `elastic` needs none. The
frequencies of the other shapers come from the calibration of the package, which was made with 5 kg, and so do their
mean delays.

{_table(result, "ramp")}

Without shaping the lag is {lag:.1f} ms: the lookahead of {1e3 * ahead:g} ms and two ticks.

## All joints at once

From the posture in which the robot starts, all joints turn by {DISTANCE:g} rad at once, with a velocity that jumps at
both ends. 2 rad/s is {DISTANCE:g} rad in 0.5 s, as in the driver's test `test_trajectory_scaled`. The acceleration
that the joints' torques permit adds to the lag.

{_table(result, "turn")}

## The driver's test

`test_trajectory_scaled` wants all joints at 0 after {APPROACH:g} s and at {-DISTANCE:g} rad 0.5 s later, linearly in
between, which is 2 rad/s. The arm is stretched out horizontally when the velocity of all its joints jumps. The
controller accelerates it no faster than the torques of the joints permit, so the arm falls behind at first and catches
up later. This adds to the lag, and grows about with the square of the speed. The table has the same motion at other
speeds as well. A simulator without dynamics, such as UR's, has no such error.

{_table(result, "jump")}
""" + "\n".join([*left_out, ""] if left_out else [])


def _table(result: dict[str, Any], way: WayName) -> str:
    return markdown_table(columns(result, way), rows(result, way), left=1)
