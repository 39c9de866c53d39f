"""What the demonstration found, in words: every number is of the run, and so is each "less" and "earlier"."""

from typing import Any

from tvist_lab.metrics.common_clock import AFTER_STOP, STILL

POSES = {"Q1": "stretched out", "Q2": "stretched out to the side", "Q3": "folded"}
"""The paper's poses in words."""


def answer(report: dict[str, Any], motion: str) -> list[str]:
    """What shaping did to one motion, and in short to the others, a sentence or two a line.

    Args:
        report: Report of the demonstration.
        motion: Name of the motion to speak of.
    """
    start, end = motion.split("-")
    unshaped, shaped = _pair(report, motion)
    before, after = unshaped["peak_m_s2"], shaped["peak_m_s2"]
    others = [f"{name}: {_in_short(*_pair(report, name))}" for name in report["baselines"] if name != motion]
    shook = f"Unshaped, its tool shook with {_number(before)} m/s² after the motion; shaped, with "
    took = f"The shaped motion took {shaped['delay_ms']:.0f} ms longer, "
    gain = _gain(unshaped, shaped)
    return [
        f"A simulated UR5e made the same motion twice, from {POSES[start]} ({start}) to {POSES[end]} ({end}).",
        f"{shook}{_number(after)}: {_changed(before, after)}.",
        f"{took}and {'yet ' if gain is not None and gain > 0 else ''}its tool {_rest(unshaped, shaped)}.",
        f"The other motions: {'; '.join(others)}.",
    ]


def terms(report: dict[str, Any], motion: str) -> dict[str, str]:
    """Words of the answer to what they mean."""
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
    """How far the figures can be trusted: words to sentences.

    Args:
        report: Report of the demonstration.
        difference: Where the replay differs first; None if it does not.
    """
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


def _pair(report: dict[str, Any], motion: str) -> tuple[dict[str, Any], dict[str, Any]]:
    methods = report["baselines"][motion]
    return methods["unshaped"], methods["shaped"]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}" if value >= 0.1 else f"{value:.3f}"


def _changed(before: float | None, after: float | None) -> str:
    """How much less or more it is."""
    if before is None or after is None or before == 0.0:
        return "not to be compared"
    percent = 100.0 * (after / before - 1.0)
    return f"{abs(percent):.0f} % {'less' if percent <= 0.0 else 'more'}"


def _gain(unshaped: dict[str, Any], shaped: dict[str, Any]) -> int | None:
    """By how much earlier the shaped tool comes to rest [ms]; None where one of the two does not."""
    before, after = unshaped["still_after_ms"], shaped["still_after_ms"]
    return None if before is None or after is None else round(before - after)


def _rest(unshaped: dict[str, Any], shaped: dict[str, Any]) -> str:
    gain = _gain(unshaped, shaped)
    if gain is not None:
        return f"came to rest {abs(gain)} ms {'earlier' if gain >= 0 else 'later'}"
    if shaped["still_after_ms"] is not None:
        return "came to rest, which the unshaped one did not"
    return "was not at rest when the recording ended"


def _in_short(unshaped: dict[str, Any], shaped: dict[str, Any]) -> str:
    return f"{_changed(unshaped['peak_m_s2'], shaped['peak_m_s2'])}, {_rest(unshaped, shaped)}"
