"""Results of a search as a page of the documentation."""

from typing import Any

from tvist_controller.api import CLEARANCE, FAR, stopping
from tvist_plant.description import load


def page(result: dict[str, Any], command: str) -> str:
    """Format a search's result as Markdown.

    Args:
        result: Result of `tvist_lab.safety.report.search`.
        command: Command line that produces it.
    """
    lines = [
        "# Stops",
        "",
        f"Made by `{command}`.",
        "What is searched for, and why it should hold: [decision 13](../decisions/0013-stops-stay-on-the-way.md).",
        "",
        "## What was tried",
        "",
        "| search | cases | promises broken |",
        "|---|---|---|",
    ]
    lines += [
        f"| {_WHAT[name]} | {part['count']} | {len(part['broken'])} |"
        for name, part in result.items()
        if isinstance(part, dict)
    ]
    if "stops" in result:
        lines += _stops(result["stops"])
    if "streams" in result:
        lines += _streams(result["streams"])
    if "changes" in result:
        part = result["changes"]
        lines += [
            "",
            "## Changes in motion",
            "",
            f"Of {part['count']} changes of payload, shaper, estimator, speed and tool {part['refused']} were refused",
            "with `collision`: the arm with the payload declared would have met something on the rest of its way.",
        ]
    return "\n".join([*lines, *_info(result["robot"]), ""])


_WHAT = {
    "stops": "stops of every kind at random moments of accepted moves, limits from 1.5 rad/s and 2 rad/s² to 3.14 and "
    "8, payload 0 to 5 kg, plain and shaped",
    "streams": "streams of set-points at the floor, at the arm itself and at limits, cut or ended at random",
    "changes": "changes in mid-motion",
    "sequences": "sequences of 40 random commands",
}


def _stops(part: dict[str, Any]) -> list[str]:
    deep = part["worst_penetration_of_the_flexible_arm_m"]
    lines = [
        "",
        "## Stops in mid-motion",
        "",
        f"At worst a stop was {1e9 * max(part['worst_ahead_rad'], 0.0):.2g} nrad ahead of what the motion would have",
        f"done, {1e9 * part['worst_off_rad']:.2g} nrad off its line and {part['worst_late_ticks']} ticks later at",
        f"rest; the rigid torque was {100 * part['worst_torque_share']:.2f} % beyond the larger of 90 % of the limit",
        "and what the motion would have asked.",
    ]
    if deep is not None:
        lines.append(
            f"The flexible arm swings beyond its reference: at worst it was {_depth(deep)}, where the reference "
            f"was {_depth(part['worst_below_clearance_m'])}."
        )
    lines += [
        "",
        "| kind | cases | takes, median [s] | at most [s] | of what was left of the motion, median | let run out |",
        "|---|---|---|---|---|---|",
    ]
    return lines + [
        f"| {kind} | {one['count']} | {one['duration_s']['median']:.3f} | {one['duration_s']['max']:.3f} | "
        f"{100 * one['share_of_time_left']['median']:.0f} % | {one['ran_out']} |"
        for kind, one in part["kinds"].items()
    ]


def _streams(part: dict[str, Any]) -> list[str]:
    deep = part["worst_penetration_of_the_flexible_arm_m"]
    lines = [
        "",
        "## Streams",
        "",
        f"{part['stopped_by_the_robot']} of {part['count']} were stopped by the robot itself. At worst the reference",
        f"was {_depth(part['worst_below_clearance_m'])}.",
    ]
    if deep is not None:
        lines.append(f"The flexible arm was {_depth(deep)}.")
    return lines


def _depth(below: float) -> str:
    """Format the smallest distance between two bodies, from the violation of the clearance [m]."""
    distance = 1e3 * (CLEARANCE - below)
    if distance > 1e3 * FAR - 0.1:
        return f"{1e3 * FAR:.0f} mm or more from the nearest other body"
    if distance >= 0.0:
        return f"{distance:.1f} mm from the nearest other body"
    return f"{-distance:.1f} mm deep in another body"


def _info(robot: str) -> list[str]:
    rows = [
        f"| {row.payload:g} | {100 * row.speed:.0f} % | {row.joint} | {row.duration:.2f} | {row.way:.2f} |"
        for row in stopping(load(robot))
    ]
    return [
        "",
        "## How long stops last and how far they go",
        "",
        "As `info` tells it: the arm stretched out, the joint that takes longest, from a share of its velocity limit.",
        "",
        "| payload [kg] | speed | joint | takes [s] | goes [rad] |",
        "|---|---|---|---|---|",
        *rows,
    ]
