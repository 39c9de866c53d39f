"""Find the same motions in two recordings, or in one without and with a shaper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvist_lab.metrics.common_clock import peak_after_stop
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.table import (
    IMPACTS,
    MeasuredRecording,
    MotionResult,
    impact_percent,
    reduction_percent,
)
from tvist_lab.metrics.vibration import TRUTH, NotMeasurableError
from tvist_lab.recordings import Floats, Recording

SAME = 0.02  # largest difference of a joint angle at start and end between motions that correspond [rad]
COMPARED = IMPACTS | {"still_after": "still_after_ms", "peak": "peak_m_s2", "envelope": "envelope_m_s2"}
"""Names of changes due to shaping, and the field of a motion's result that each compares."""
TICK_MS = 2.0  # shortest delay of a shaped reference [ms]: one tick
SAME_DURATION = (0.02, 0.01)  # largest difference in duration of equal motions: relative [-], or [s]
REFERENCE = "reference_q"


@dataclass(frozen=True)
class MotionChange:
    """Vibration of the same motion without and with a shaper; None if not measurable."""

    before: float | None = None  # largest |α| after the unshaped motion [m/s²]
    after: float | None = None  # largest |α| after the shaped one [m/s²]
    still_before: float | None = None  # time from the unshaped motion's start until the tool is at rest [ms]
    still_after: float | None = None  # time from the shaped motion's start until the tool is at rest [ms]

    @property
    def less_percent(self) -> float | None:
        """Reduction of the vibration [%], negative if it grew; None if not defined."""
        if self.before is None or self.after is None or self.before == 0.0:
            return None
        return reduction_percent(self.before, self.after)

    @property
    def gain_ms(self) -> int | None:
        """Time by which the tool is at rest earlier [ms], negative if later; None if it is never at rest."""
        if self.still_before is None or self.still_after is None:
            return None
        return round(self.still_before - self.still_after)

    def as_dict(self) -> dict[str, float | None]:
        """Return the numbers that the page of `tvist view` shows."""
        return {
            "less_percent": self.less_percent,
            "earlier_ms": self.gain_ms,
            "before": self.before,
            "after": self.after,
        }

    def less(self) -> str:
        """Return the reduction as text."""
        percent = self.less_percent
        if percent is None:
            return "not to be compared"
        return f"{abs(percent):.0f} % {'less' if percent >= 0.0 else 'more'}"

    def rest(self) -> str:
        """Return as text how the settling time changed."""
        if self.gain_ms is not None:
            return f"came to rest {abs(self.gain_ms)} ms {'earlier' if self.gain_ms >= 0 else 'later'}"
        if self.still_after is not None:
            return "came to rest, which the unshaped one did not"
        return "was not at rest when the recording ended"

    def in_short(self) -> str:
        """Return both changes as one line of text."""
        return f"{self.less()}, {self.rest()}"


@dataclass(frozen=True)
class ComparedMotion:
    """One motion that both recordings contain."""

    a: int
    """Number in the first recording, from 1."""
    b: int
    """Number in the second recording, from 1."""
    first: MotionResult
    """Figures in the first recording."""
    second: MotionResult
    """Figures in the second recording."""

    @property
    def impact_percent(self) -> Mapping[str, float | None]:
        """Change from the first to the second recording [%]; None if a figure is missing or the first is 0."""
        return {
            name: impact_percent(getattr(self.first, field), getattr(self.second, field))
            for name, field in COMPARED.items()
        }

    @property
    def change(self) -> MotionChange:
        """Change of the vibration after the stop."""
        both = self.first, self.second
        return MotionChange(*(one.peak_m_s2 for one in both), *(one.still_after_ms for one in both))

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain values for `tvist log analyze A B`."""
        return {
            "number": {"a": self.a, "b": self.b},
            "a": self.first.as_dict(),
            "b": self.second.as_dict(),
            "impact_percent": dict(self.impact_percent),
        }


@dataclass(frozen=True)
class Comparison:
    """Motions that two recordings share, and those that only one of them has."""

    motions: tuple[ComparedMotion, ...]
    only_in_a: tuple[int, ...]
    """Numbers of motions, from 1, that only the first recording has."""
    only_in_b: tuple[int, ...]
    """Numbers of motions, from 1, that only the second recording has."""


def compare(first: MeasuredRecording, second: MeasuredRecording) -> Comparison:
    """Pair as many motions of two recordings as possible, in order."""
    # Motions correspond if they start and end at the same joint angles within 0.02 rad.
    ways = [[ends_of(one.recording, motion) for motion in one.motions] for one in (first, second)]
    pairs = _pairs(*ways)
    compared = tuple(ComparedMotion(a + 1, b + 1, first.results[a], second.results[b]) for a, b in pairs)
    taken = [{pair[side] for pair in pairs} for side in (0, 1)]
    alone = [tuple(n + 1 for n in range(len(ways[side])) if n not in taken[side]) for side in (0, 1)]
    return Comparison(compared, *alone)


def ends_of(recording: Recording, motion: MotionRows, column: str = "") -> Floats:
    """Return the joint angles at both ends of a motion, by default of the target, shape (2, n) [rad]."""
    q = recording[column or ("target_q" if "target_q" in recording else "actual_q")]
    return q[[motion.start, motion.arm_stop(recording)]]


def same_ends(first: Floats, second: Floats) -> bool:
    """Return whether two motions start and end at the same postures, within 0.02 rad."""
    return first.shape == second.shape and bool(np.max(np.abs(first - second)) <= SAME)


def _pairs(first: Sequence[Floats], second: Sequence[Floats]) -> list[tuple[int, int]]:
    """Return the longest sequence of corresponding motions in the order of both recordings."""
    same = [[same_ends(a, b) for b in second] for a in first]
    # longest[i, j]: most pairs among the motions from index i in the first and from j in the second.
    longest = np.zeros((len(first) + 1, len(second) + 1), dtype=int)
    for i in reversed(range(len(first))):
        for j in reversed(range(len(second))):
            longest[i, j] = (
                longest[i + 1, j + 1] + 1 if same[i][j] else max(longest[i + 1, j], longest[i, j + 1])
            )
    pairs, i, j = [], 0, 0
    while i < len(first) and j < len(second):
        if same[i][j]:
            pairs.append((i, j))
            i, j = i + 1, j + 1
        elif longest[i + 1, j] >= longest[i, j + 1]:
            i += 1
        else:
            j += 1
    return pairs


@dataclass(frozen=True)
class MotionPair:
    """The same motion without and with a shaper."""

    unshaped: int
    """Index of the motion in the recording."""
    shaped: int
    shaper: str
    """Name of the shaper; empty if the recording does not name it."""
    name: str
    """Named poses at the motion's ends, such as `Q1 → Q3`; if an end has no name, both motions' numbers."""
    change: MotionChange


def pairs(measured: MeasuredRecording) -> list[MotionPair]:
    """Pair each unshaped motion with the same motion by each shaper, in the order the robot made them."""
    # Motions are the same if their references before shaping start and end at the same joint angles within
    # 0.02 rad, and last equally long within 2 %. Events tell whether a motion was shaped, else its delay
    # does.
    recording, found = measured.recording, measured.motions
    if REFERENCE not in recording:
        return []
    delays = [result.delay_ms for result in measured.results]
    shapers = [shaper_of(recording, *one) for one in zip(found, delays, strict=True)]
    taken: set[tuple[int, str]] = set()
    made = []
    for place, motion in enumerate(found):
        shaper = shapers[place]
        if shaper is None or motion.stopped:
            continue
        for other, unshaped in enumerate(found):
            free = shapers[other] is None and not unshaped.stopped and (other, shaper) not in taken
            if free and _same(recording, unshaped, motion):
                taken.add((other, shaper))
                peaks = (_peak(measured, one) for one in (other, place))
                rests = (measured.results[one].still_after_ms for one in (other, place))
                name = _name(recording, unshaped) or f"motions {other + 1} and {place + 1}"
                made.append(MotionPair(other, place, shaper, name, MotionChange(*peaks, *rests)))
                break
    return sorted(made, key=lambda pair: (pair.unshaped, pair.shaped))


def _peak(measured: MeasuredRecording, place: int) -> float | None:
    """Return the largest |α| after a motion, true if recorded, else from the sensor [m/s²]."""
    if TRUTH not in measured.recording:
        return measured.results[place].peak_m_s2
    try:
        return peak_after_stop(measured.recording, measured.motions[place])
    except NotMeasurableError:
        return None


def shaper_of(recording: Recording, motion: MotionRows, delay: float | None) -> str | None:
    """Return the name of a motion's shaper, empty if unknown; None if there was none.

    `delay` is the time by which the target ends after its reference [ms]; None if the log has no such reference.
    """
    tick = recording["tick"][motion.start] if "tick" in recording else np.inf
    told = [one.why for one in recording.events if one.kind == "shaper_changed" and one.tick <= tick + 1]
    if told:
        name = str(told[-1]).split(" with ")[0]
        return None if name == "none" else name
    begun = "" if recording.info is None else recording.info.shaper
    return None if (delay or 0.0) < TICK_MS else begun.replace("none", "")


def _same(recording: Recording, one: MotionRows, other: MotionRows) -> bool:
    lasts, (share, least) = one.duration(recording), SAME_DURATION
    if abs(other.duration(recording) - lasts) > max(share * lasts, least):
        return False
    return same_ends(*(ends_of(recording, motion, REFERENCE) for motion in (one, other)))


def _name(recording: Recording, motion: MotionRows) -> str:
    """Return the named poses at a motion's ends; empty if an end has no name."""
    poses, ends = getattr(recording.info, "poses", None) or {}, []
    for q in recording[REFERENCE][[motion.start, motion.reference_stop]]:
        ends += [name for name, pose in poses.items() if same_ends(q, np.array(pose))][:1]
    return " → ".join(ends) if len(ends) == 2 else ""
