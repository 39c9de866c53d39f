"""Results of `tvist study paths`, as JSON has them, and as tables of a page."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tvist_lab.studies.evaluate import interval, percentiles
from tvist_lab.studies.pages import page
from tvist_lab.studies.path_shaping import JOINTS, WAYS
from tvist_lab.studies.paths import Followed, JudgedPath
from tvist_lab.study.measures import WORTH
from tvist_lab.study.tables import Shown, in_markdown

COLUMNS = (
    Shown("shaper", "name"), Shown("shaped", "way"), Shown("less %", "reduction_percent.median", 1),
    Shown("p5", "reduction_percent.p5", 1), Shown("min", "reduction_percent.min", 1),
    Shown("delay ms", "delay_ms.median", 0), Shown("in motion", "in_motion_ratio.median", 2),
    Shown("off mm", "off_mm.median", 4), Shown("max", "off_mm.max", 4),
    Shown("turned mrad", "turned_mrad.median", 4), Shown("q̇ max", "peak_velocity_ratio.max", 3),
    Shown("q̈ max", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
"""Columns of the table of all paths."""
TERMS = {
    "less": "reduction of the largest |α|, the true acceleration of the tool, later than 10 ms after the stop of the "
    "shaped reference; median, 5th percentile and smallest",
    "delay": "extra duration compared with the path planned without a shaper, median",
    "in motion": "rms of the difference between α and that of a rigid arm until the stop, divided by the value "
    "unshaped, median",
    "off": "largest distance of the shaped reference from the path; median and largest",
    "turned": "largest angle from the orientation at that place, median",
    "q̇, q̈": "largest velocity and acceleration of a joint, divided by those before shaping; largest",
}
"""What the columns mean."""
KIND_NAMES = {"line": "lines", "arc": "arcs", "blends": "paths with blends"}
"""Names of the kinds of paths, in the plural."""


def report(judged: Sequence[JudgedPath]) -> dict[str, Any]:
    """Return the part of `tvist study paths --json` about the paths."""
    groups = {"all": list(judged)}
    for one in judged:
        groups.setdefault(one.move.kind, []).append(one)
    return {
        "refused": sum(one.refused for one in judged),
        "stopping": sum(one.stopping for one in judged),
        "paths": [_row(one) for one in judged],
        "summary": {name: _group(group) for name, group in groups.items()},
    }


def _row(one: JudgedPath) -> dict[str, Any]:
    pace = one.move.command.segments[0]
    return {
        "kind": one.move.kind,
        "segments": len(one.move.command.segments),
        "length_m": one.length,
        "velocity_m_s": pace.velocity,
        "acceleration_m_s2": pace.acceleration,
        "payload_kg": one.move.mass,
        "duration_s": one.unshaped.duration,
        "unshaped_peak_m_s2": one.unshaped.peak,
        "unshaped_in_motion_m_s2": one.unshaped.in_motion,
        "shaped": {
            name: {way: _figures(one, found) for way, found in ways.items()}
            for name, ways in one.shaped.items()
        },
    }


def _figures(one: JudgedPath, found: Followed) -> dict[str, Any]:
    return {
        "peak_m_s2": found.peak,
        "reduction_percent": one.reduction(found) if one.counts else None,
        "delay_ms": _delay(one, found),
        "in_motion_ratio": _in_motion(one, found),
        "off_mm": 1e3 * found.off,
        "turned_mrad": 1e3 * found.turned,
        "peak_velocity_ratio": found.velocity,
        "peak_acceleration_ratio": found.acceleration,
    }


def _delay(one: JudgedPath, found: Followed) -> float:
    return round(1e3 * (found.duration - one.unshaped.duration), 6)


def _in_motion(one: JudgedPath, found: Followed) -> float:
    return found.in_motion / one.unshaped.in_motion


def _group(group: list[JudgedPath]) -> dict[str, Any]:
    counted = [one for one in group if one.counts]
    return {
        "paths": len(group),
        "counted": len(counted),
        "unshaped_peak_m_s2": percentiles([one.unshaped.peak for one in group], median=50, max=100),
        "shapers": {
            name: {way: _way(group, name, way) for way in WAYS} for name in (group[0].shaped if group else ())
        },
    }


def _way(group: list[JudgedPath], name: str, way: str) -> dict[str, Any]:
    """Summarize one way to shape the paths; reductions only over those that count."""
    pairs = [(one, one.shaped[name][way]) for one in group]
    reductions = np.array([one.reduction(found) for one, found in pairs if one.counts])
    return {
        "peak_m_s2": percentiles([found.peak for one, found in pairs if one.counts], median=50, p95=95),
        "reduction_percent": percentiles(reductions, median=50, p5=5, min=0),
        "reduction_percent_interval": interval(reductions, 50),
        "delay_ms": percentiles([_delay(*pair) for pair in pairs], median=50, max=100),
        "in_motion_ratio": percentiles([_in_motion(*pair) for pair in pairs], median=50, p95=95),
        "off_mm": percentiles([1e3 * found.off for _, found in pairs], median=50, p95=95, max=100),
        "turned_mrad": percentiles([1e3 * found.turned for _, found in pairs], median=50, p95=95, max=100),
        "peak_velocity_ratio": percentiles([found.velocity for _, found in pairs], median=50, max=100),
        "peak_acceleration_ratio": percentiles(
            [found.acceleration for _, found in pairs], median=50, max=100
        ),
    }


def rows(group: dict[str, Any]) -> list[dict[str, Any]]:
    """Entries of the table of a group of the summary, without those that equal the one above."""
    return [
        {"name": name, "way": WAYS[way], **found}
        for name, ways in group["shapers"].items()
        for way, found in ways.items()
        if way == JOINTS or found != ways[JOINTS]
    ]


def page_of(result: dict[str, Any], command: str) -> str:
    """Return the tables with explanations, as the body of a page."""
    kinds = [(kind, group) for kind, group in result["summary"].items() if kind != "all"]
    tables = [(title_of(*one), in_markdown(rows(one[1]), COLUMNS, left=2)) for one in kinds]
    in_words = circle_in_words(result["circle"])
    return page("paths", result, command, tables=tables, terms=TERMS, circle_in_words=in_words)


def title_of(kind: str, group: dict[str, Any]) -> str:
    """Title of a table of one kind of paths."""
    peak = group["unshaped_peak_m_s2"]
    return (
        f"{group['paths']} {KIND_NAMES[kind]}, {group['counted']} of them with an unshaped peak of {WORTH:g} m/s² or "
        f"more, which count in the percentages; median {peak['median']:.2f} m/s²"
    )


def circle_in_words(circle: dict[str, Any]) -> str:
    """Say how far the circle is left in both ways."""
    constant, largest = circle["at_constant_speed_mm"], circle["largest_distance_mm"]
    return (
        f"On a circle with a radius of {circle['radius_mm']:g} mm at {circle['speed_m_s']:g} m/s, "
        f"`{circle['shaper']}` for {circle['f_d_hz']:g} Hz and ζ = {circle['zeta']:g}, joint by joint, leaves the path "
        f"by {constant['joints']:.2f} mm at constant speed and by {largest['joints']:.2f} mm at most. Averaging the "
        f"circle itself would lose {circle['predicted_mm']:.2f} mm of its radius. Along the path it is left by "
        f"{1e6 * largest['along']:.0f} nm."
    )
