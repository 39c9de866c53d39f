"""Find the same motions in two recordings, or in one without and with a shaper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvist_lab.change import MotionChange
from tvist_lab.metrics.common_clock import peak_after_stop
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.table import IMPACTS, MeasuredRecording, MotionResult, impact_percent
from tvist_lab.metrics.vibration import TRUTH, NotMeasurableError
from tvist_lab.recordings import Floats, Recording

SAME = 0.02  # largest difference of a joint angle at start and end between motions that correspond [rad]
COMPARED = IMPACTS | {"still_after": "still_after_ms", "peak": "peak_m_s2", "envelope": "envelope_m_s2"}
"""Names of the impacts, and the figures of a motion that they compare."""
TICK_MS = 2.0  # shortest delay of a shaped reference [ms]: one tick
SAME_DURATION = (0.02, 0.01)
"""Largest difference in duration between motions of the same speed: relative [-], or in s."""
REFERENCE = "reference_q"


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
    ways = [[MotionEnds.of(one.recording, motion) for motion in one.motions] for one in (first, second)]
    pairs = _pairs(*ways)
    compared = tuple(ComparedMotion(a + 1, b + 1, first.results[a], second.results[b]) for a, b in pairs)
    taken = [{pair[side] for pair in pairs} for side in (0, 1)]
    alone = [tuple(n + 1 for n in range(len(ways[side])) if n not in taken[side]) for side in (0, 1)]
    return Comparison(compared, *alone)


@dataclass(frozen=True)
class MotionEnds:
    """Joint angles at both ends of a motion."""

    start: Floats
    end: Floats

    @classmethod
    def of(cls, recording: Recording, motion: MotionRows, column: str = "") -> "MotionEnds":
        """Return the ends of a motion in a column of joint angles; by default, in the target."""
        q = recording[column or ("target_q" if "target_q" in recording else "actual_q")]
        return cls(q[motion.start], q[motion.arm_stop(recording)])

    def corresponds(self, other: "MotionEnds") -> bool:
        """Whether both ends are the same, within 0.02 rad."""
        if self.start.shape != other.start.shape:
            return False
        away = np.abs(np.concatenate([self.start - other.start, self.end - other.end]))
        return bool(np.max(away) <= SAME)


def _pairs(first: Sequence[MotionEnds], second: Sequence[MotionEnds]) -> list[tuple[int, int]]:
    """Return the longest sequence of corresponding motions in the order of both recordings."""
    same = np.array([[a.corresponds(b) for b in second] for a in first], dtype=bool).reshape(
        len(first), len(second)
    )
    # longest[i, j]: most pairs among the motions from index i in the first and from j in the second.
    longest = np.zeros((len(first) + 1, len(second) + 1), dtype=int)
    for i in reversed(range(len(first))):
        for j in reversed(range(len(second))):
            longest[i, j] = (
                longest[i + 1, j + 1] + 1 if same[i, j] else max(longest[i + 1, j], longest[i, j + 1])
            )
    pairs, i, j = [], 0, 0
    while i < len(first) and j < len(second):
        if same[i, j]:
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
    """Named poses at its ends, `Q1 → Q3`, else the numbers of both motions."""
    change: MotionChange


def pairs(measured: MeasuredRecording) -> list[MotionPair]:
    """Pair each unshaped motion with the same one by each shaper, in the order in which they were made."""
    # Motions are the same if their references before shaping start and end at the same joint angles within
    # 0.02 rad, and last equally long within 2 %. Events tell whether a motion was shaped, else its delay
    # does.
    recording, found = measured.recording, measured.motions
    if REFERENCE not in recording:
        return []
    shapers = [shaper_of(recording, motion, measured.results[place].delay_ms)
               for place, motion in enumerate(found)]  # fmt: skip
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
    first, second = (MotionEnds.of(recording, motion, REFERENCE) for motion in (one, other))
    lasts = one.duration(recording)
    share, least = SAME_DURATION
    differs = abs(other.duration(recording) - lasts)
    return differs <= max(share * lasts, least) and first.corresponds(second)


def _name(recording: Recording, motion: MotionRows) -> str:
    poses = getattr(recording.info, "poses", None) or {}
    q = recording[REFERENCE]
    ends = [_pose(poses, q[row]) for row in (motion.start, motion.reference_stop)]
    return " → ".join(ends) if all(ends) else ""


def _pose(poses: dict[str, Sequence[float]], q: Floats) -> str:
    near = (name for name, pose in poses.items() if len(pose) == len(q) and np.abs(q - pose).max() <= SAME)
    return next(near, "")
