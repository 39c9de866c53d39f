"""Results of `tvist study tracking`, as JSON has them, and as tables of a page."""

from collections.abc import Mapping, Sequence
from typing import Any

from tvist_lab.markdown_table import markdown_table
from tvist_lab.studies.pages import page
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


def page_of(result: dict[str, Any]) -> str:
    """Return a page with the tables and what they mean."""
    tables = {way: markdown_table(columns(result, way), rows(result, way), left=1) for way in TITLES}
    numbers = {"APPROACH": APPROACH, "CONSTANT": CONSTANT, "DISTANCE": DISTANCE, "RAMP": RAMP}
    return page("tracking", result, result["command"], tables=tables, **numbers)
