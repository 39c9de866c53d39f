"""Two recordings of the same motions, motion by motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.table import IMPACTS, Measured, MotionResult, impact_percent
from tvist_lab.recordings import Floats, Recording

SAME = 0.02
"""Largest difference of a joint angle, at the start and at the end, between motions that correspond [rad]."""
COMPARED = IMPACTS | {"still_after": "still_after_ms", "peak": "peak_m_s2", "envelope": "envelope_m_s2"}
"""Names of the impacts, and the figures of a motion that they compare."""


@dataclass(frozen=True)
class ComparedMotion:
    """One motion that both recordings contain."""

    a: int
    """Its number in the first recording, from 1."""
    b: int
    """Its number in the second."""
    first: MotionResult
    """Its figures in the first recording."""
    second: MotionResult
    """Its figures in the second."""

    @property
    def impact_percent(self) -> Mapping[str, float | None]:
        """Change from the first to the second recording [%]; None where one of them has no figure or the first is 0."""
        return {
            name: impact_percent(getattr(self.first, field), getattr(self.second, field))
            for name, field in COMPARED.items()
        }

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain values, as `tvist log analyze A B` prints them."""
        return {
            "number": {"a": self.a, "b": self.b},
            "a": self.first.as_dict(),
            "b": self.second.as_dict(),
            "impact_percent": dict(self.impact_percent),
        }


@dataclass(frozen=True)
class Comparison:
    """What two recordings have in common, and what only one of them has."""

    motions: tuple[ComparedMotion, ...]
    only_in_a: tuple[int, ...]
    """Numbers of motions of the first recording, from 1, to which none of the second corresponds."""
    only_in_b: tuple[int, ...]
    """The same of the second recording."""


def compare(first: Measured, second: Measured) -> Comparison:
    """Pair the motions of two recordings.

    Motions correspond if they start and end at the same joint angles within 0.02 rad; they are paired in order, as
    many as possible.
    """
    ways = [[Way.of(one.recording, motion) for motion in one.motions] for one in (first, second)]
    pairs = _pairs(*ways)
    compared = tuple(ComparedMotion(a + 1, b + 1, first.results[a], second.results[b]) for a, b in pairs)
    taken = [{pair[side] for pair in pairs} for side in (0, 1)]
    alone = [tuple(n + 1 for n in range(len(ways[side])) if n not in taken[side]) for side in (0, 1)]
    return Comparison(compared, *alone)


@dataclass(frozen=True)
class Way:
    """The two ends of a motion."""

    start: Floats
    end: Floats

    @classmethod
    def of(cls, recording: Recording, motion: MotionRows, column: str = "") -> "Way":
        """Return the ends of a motion by a column of joint angles; by default, those of the target."""
        q = recording[column or ("target_q" if "target_q" in recording else "actual_q")]
        return cls(q[motion.start], q[motion.arm_stop(recording)])

    def corresponds(self, other: "Way") -> bool:
        """Whether both ends are the same, within 0.02 rad."""
        if self.start.shape != other.start.shape:
            return False
        away = np.abs(np.concatenate([self.start - other.start, self.end - other.end]))
        return bool(np.max(away) <= SAME)


def _pairs(first: Sequence[Way], second: Sequence[Way]) -> list[tuple[int, int]]:
    """Longest sequence of corresponding motions in the order of both recordings."""
    same = np.array([[a.corresponds(b) for b in second] for a in first], dtype=bool).reshape(
        len(first), len(second)
    )
    # longest[i, j]: number of pairs among the motions from i and from j on.
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
