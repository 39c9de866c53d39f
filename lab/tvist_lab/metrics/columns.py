"""The table of motions for terminal and page: columns with their meanings, and cells."""

import re
from collections.abc import Sequence

from tvist_lab.metrics.table import MotionResult

COLUMNS = {
    "motion": "Number of the motion.",
    "start\ns": "Time of the log at which the motion starts; since the first row if the log has the time of day.",
    "stop\ns": "Time of the log at which its target, the shaped reference, stops.",
    "longer\nΔ ms": "Time by which shaping lengthens the reference.",
    "settling\nt_stb ms": "Time from first entering a band of 0.03 mm around where the tool ends until staying inside.",
    "cycle\nt_cycle ms": "Time from the start until the tool stays inside that band.",
    "overshoot\ne_os mm": "Largest distance from the attained position after first entering the band.",
    "vibration\nRV m/s²": "Residual: an exponential fitted to the peaks of 0.3 s after the stop, at the stop.",
    "at rest\nafter ms": "Last time the tool's acceleration exceeds 0.1 m/s², from the start of the motion.",
    "peak\nm/s²": "Largest acceleration of the tool after the stop and the declared delay.",
    "frequency\nf_d Hz": "Damped frequency of the strongest mode after the stop, with its 95 % interval.",
    "damping\nζ": "Damping ratio of that mode, with its 95 % interval.",
    "also\nf_d Hz": "Damped frequencies of up to two further modes, the stronger one first.",
}
"""Meaning of each column, by its head with symbol and unit in a second line."""
WORDS = {
    "start_s": "start", "stop_s": "stop", "delay_ms": "longer", "stabilisation_ms": "settling", "cycle_ms": "cycle",
    "overshoot_m": "overshoot", "residual_vibration_m_s2": "vibration", "still_after_ms": "at rest",
    "peak_m_s2": "peak", "envelope_m_s2": "envelope", "peak_acceleration_rad_s2": "acceleration of the reference",
    "f_d_hz": "frequency",
    "f_d_interval_hz": "frequency", "zeta": "damping", "zeta_interval": "damping", "servo_lag_ms": "lag of the servo",
}  # fmt: skip
"""Names of a motion's figures in notes."""
NAMED = 3  # largest number of motions that a line names; if there are more, it counts them


def motion_cells(results: Sequence[MotionResult], origin: float) -> list[tuple[str, ...]]:
    """Return the rows of the table, with intervals on a second line; `origin` is the log's time shown as zero [s]."""
    return [
        (
            str(place),
            number(one.start_s - origin, 3),
            number(one.stop_s - origin, 3),
            number(one.delay_ms, 0),
            number(one.stabilisation_ms, 0),
            number(one.cycle_ms, 0),
            number(None if one.overshoot_m is None else 1e3 * one.overshoot_m, 3),
            number(one.residual_vibration_m_s2, 2),
            number(one.still_after_ms, 0),
            number(one.peak_m_s2, 2),
            number(one.f_d_hz, 2, one.f_d_interval_hz),
            number(one.zeta, 3, one.zeta_interval),
            ", ".join(number(mode["f_d_hz"], 1) for mode in one.modes[1:]) or "–",
        )
        for place, one in enumerate(results, 1)
    ]


def number(value: float | None, digits: int, interval: tuple[float, float] | None = None) -> str:
    """Format a number, with its interval on a second line; a dash if it was not measurable."""
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return text if interval is None else f"{text}\n({interval[0]:.{digits}f}–{interval[1]:.{digits}f})"


def percent(change: float | None) -> str:
    """Format a change with its sign; a dash if it is not known."""
    return "–" if change is None else f"{round(change):+d} %"


def grouped_notes(results: Sequence[MotionResult]) -> list[str]:
    """Return one line for each kind of note, with its motions and figures."""
    # Notes that differ only in their numbers are of one kind; the first one represents all.
    kinds: dict[str, dict[str, set[int]]] = {}
    first: dict[str, str] = {}
    for index, result in enumerate(results, 1):
        for name, note in result.notes.items():
            kind = re.sub(r"\d[\d.]*", "0", note)
            first.setdefault(kind, note)
            kinds.setdefault(kind, {}).setdefault(name, set()).add(index)
    lines = []
    for kind, names in kinds.items():
        numbers = sorted(set().union(*names.values()))
        which = f"motion {', '.join(map(str, numbers))}"
        if len(numbers) == len(results) > 1:
            which = "all motions"
        elif len(numbers) > NAMED:
            which = f"{len(numbers)} of {len(results)} motions"
        same = all(result.notes.get(name) in (None, first[kind]) for result in results for name in names)
        words = dict.fromkeys(WORDS.get(name, name) for name in names)
        lines.append(f"{which}, {', '.join(words)}: {'' if same else 'as '}{first[kind]}")
    return lines
