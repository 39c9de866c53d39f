"""Results of a search as a page of the documentation."""

from collections.abc import Sequence
from typing import Any

from tvist_controller.api import CLEARANCE, FAR, stopping
from tvist_lab.safety.stops import ROUNDING
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
        f"This page was made by `{command}`.",
        "[Decision 13](../decisions/0013-stops-stay-on-the-way.md) says what a stop promises, and why it should hold.",
        "",
        "## What was tested",
        "",
        f"Robots, which took turns, each with its own calibration: {', '.join(result['robots'])}. The limits of the",
        "motions were at most the arm's own; above these, the robot had to refuse.",
        "",
        "| search | cases | promises broken |",
        "|---|---|---|",
    ]
    lines += [
        f"| {_WHAT[name]} | {part['count']} | {len(part['broken'])} |"
        for name, part in result.items()
        if isinstance(part, dict)
    ]
    if "kinds" in result.get("stops", {}):
        lines += _stops(result["stops"])
    if "stopped_by_the_robot" in result.get("streams", {}):
        lines += _streams(result["streams"])
    if "changes" in result:
        part = result["changes"]
        lines += [
            "",
            "## Changes in motion",
            "",
            f"Of {part['count']} changes of payload, shaper, estimator, speed and tool, {part['refused']} were refused",
            "with `collision`: the arm with the declared payload would have hit something on the rest of its path.",
        ]
    return "\n".join([*lines, *_info(result["robots"]), ""])


_WHAT = {
    "stops": "stops of every kind at random moments of accepted moves, payloads up to the rated one, every shaper",
    "streams": "streams of set-points towards the floor, the arm itself and the limits, cut or ended at random",
    "changes": "changes during a motion",
    "sequences": "sequences of 40 random commands, a third of them with programs in URScript",
}


def _stops(part: dict[str, Any]) -> list[str]:
    deep = part["worst_penetration_of_the_flexible_arm_m"]
    lines = [
        "",
        "## Stops during a motion",
        "",
        f"No stop was ahead of the motion by more than {_angle(part['worst_ahead_rad'])},",
        f"or off its line by more than {_angle(part['worst_off_rad'])}, {_late(part['worst_late_ticks'])}.",
        f"The rigid torque {_beside(part['worst_torque_share'])} the larger of 90 % of the limit and the",
        "torque that the motion would have needed.",
        *_speeds(part),
    ]
    if deep is not None:
        lines.append(
            f"The flexible arm swings beyond its reference: in the worst case it was {_depth(deep)}, and the reference "
            f"was {_depth(part['worst_below_clearance_m'])}."
        )
    lines += [
        "",
        "| kind | cases | duration, median [s] | maximum [s] | share of the time left, median | motion ran out |",
        "|---|---|---|---|---|---|",
    ]
    return lines + [
        f"| {kind} | {one['count']} | {one['duration_s']['median']:.3f} | {one['duration_s']['max']:.3f} | "
        f"{100 * one['share_of_time_left']['median']:.0f} % | {one['ran_out']} |"
        for kind, one in part["kinds"].items()
    ]


def _angle(deviation: float) -> str:
    """Format the largest deviation of a stop [rad]."""
    text = f"{1e9 * max(deviation, 0.0):.2g} nrad".replace("e-0", "e-")
    return f"{text} (rounding)" if deviation <= ROUNDING else text


def _late(ticks: int) -> str:
    """Format by how much a stop came to rest later than the motion."""
    if ticks > 0:
        return f"and none came to rest more than {ticks} ticks later than the motion"
    return "and none came to rest later than the motion"


def _beside(share: float) -> str:
    """Format how far the largest torque was from its bound, as a share of the bound."""
    if share > 0.0:
        return f"was at most {100 * share:.2f} % above"
    return f"stayed at least {-100 * share:.2f} % below"


def _streams(part: dict[str, Any]) -> list[str]:
    deep = part["worst_penetration_of_the_flexible_arm_m"]
    lines = [
        "",
        "## Streams",
        "",
        f"The robot itself stopped {part['stopped_by_the_robot']} of {part['count']} streams. In the worst case, the",
        f"reference was {_depth(part['worst_below_clearance_m'])}.",
        *_speeds(part),
    ]
    if deep is not None:
        lines.append(f"The flexible arm was {_depth(deep)}.")
    return lines


def _speeds(part: dict[str, Any]) -> list[str]:
    velocity, acceleration = (100 * part[f"worst_{name}_share"] for name in ("velocity", "acceleration"))
    return [
        f"No joint had more than {velocity:.1f} % of its velocity and {acceleration:.1f} % of its acceleration."
    ]


def _depth(below: float) -> str:
    """Format the smallest distance between two bodies, from the violation of the clearance [m]."""
    distance = 1e3 * (CLEARANCE - below)
    if distance > 1e3 * FAR - 0.1:
        return f"{1e3 * FAR:.0f} mm or more from the nearest other body"
    if distance >= 0.0:
        return f"{distance:.1f} mm from the nearest other body"
    return f"{-distance:.1f} mm deep in another body"


def _info(robots: Sequence[str]) -> list[str]:
    rows = [
        f"| {robot} | {row.payload:g} | {100 * row.speed:.0f} % | {row.joint} | {row.duration:.2f} | {row.way:.2f} |"
        for robot in robots
        for row in stopping(load(robot))
    ]
    return [
        "",
        "## How long stops last and how far they go",
        "",
        "These are the values in `info`, for the stretched arm and the joint that takes longest to stop,",
        "from a share of its velocity limit.",
        "",
        "| robot | payload [kg] | speed | joint | duration [s] | distance [rad] |",
        "|---|---|---|---|---|---|",
        *rows,
    ]
