"""Describe the result of the demonstration in words, with numbers only from the run."""

from typing import Any

from tvist_lab.metrics.common_clock import AFTER_STOP, STILL
from tvist_lab.metrics.comparison import MotionChange

POSES = {"Q1": "stretched out", "Q2": "stretched out to the side", "Q3": "folded"}


def answer(report: dict[str, Any], motion: str) -> list[str]:
    """Return lines of one or two sentences on shaping's effect on one motion, and briefly on the others."""
    start, end = motion.split("-")
    change, longer = _change(report, motion), report["baselines"][motion]["shaped"]["delay_ms"]
    before, after = map(_number, (change.before, change.after))
    others = [f"{name}: {_change(report, name).in_short()}" for name in report["baselines"] if name != motion]
    yet = "yet " if change.gain_ms is not None and change.gain_ms > 0 else ""
    return [
        f"A simulated UR5e made the same motion twice, from {POSES[start]} ({start}) to {POSES[end]} ({end}).",
        f"Unshaped, its tool shook with {before} m/s² after the motion; shaped, with {after}: {change.less()}.",
        f"The shaped motion took {longer:.0f} ms longer, and {yet}its tool {change.rest()}.",
        f"The other motions: {'; '.join(others)}.",
    ]


def terms(report: dict[str, Any], motion: str) -> dict[str, str]:
    """Return the terms of the answer with their meanings."""
    start, end = (report["table_1"][name]["f_d_hz"] for name in motion.split("-"))
    shaped = (
        "To keep the arm from shaking, the robot splits its command in two, half a period of the arm's vibration "
        "apart, so that the vibration of the second part cancels that of the first. It follows the arm's frequency "
        "on the way, here from "
    )
    return {
        "shaped": f"{shaped}{start:.1f} to {end:.1f} Hz.",
        "shook": "This is the largest acceleration of the tool later than "
        f"{1e3 * AFTER_STOP:.0f} ms after the end of the commanded motion.",
        "rest": f"From this moment on, the acceleration stays below {STILL:g} m/s².",
    }


def checks(report: dict[str, Any], difference: str | None) -> dict[str, str]:
    """Return what limits the accuracy of the figures; `difference` is the first one in the replay, if any."""
    ticks, missed, lost = (
        report[name] for name in ("replayed_ticks", "missed_ticks", "states_lost_on_the_way")
    )
    equal = f"gave the same {ticks} states, equal to the last bit"
    replayed = equal if difference is None else f"gave OTHER states: {difference}"
    said = {"repeatable": f"The recorded commands, run again without a clock, {replayed}."}
    if missed:
        said["late"] = (
            f"{missed} of the {ticks} ticks of 2 ms began late, because this machine was busy. This changes no figure: "
            "each tick simulates 2 ms, however late it begins."
        )
    if lost:
        said["lost"] = (
            f"{lost} states did not reach this program, because this machine was busy. The figures are those of the "
            "robot's own recording, which contains every state."
        )
    if not report["recording_gives_same_figures"]:
        said["different"] = "What arrived over the network gives OTHER figures than the recording."
    return said


def _change(report: dict[str, Any], motion: str) -> MotionChange:
    methods = [report["baselines"][motion][name] for name in ("unshaped", "shaped")]
    return MotionChange(*(method[figure] for figure in ("peak_m_s2", "still_after_ms") for method in methods))


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}" if value >= 0.1 else f"{value:.3f}"
