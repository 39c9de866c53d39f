"""Motions that one recording contains without and with a shaper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_lab.change import Change
from tvist_lab.metrics.common_clock import peak_after_stop
from tvist_lab.metrics.comparison import SAME, Way
from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.table import Measured
from tvist_lab.metrics.vibration import TRUTH
from tvist_lab.recordings import Floats, Recording

TICK_MS = 2.0
"""Shortest delay of a shaped reference [ms]: one tick."""
SAME_DURATION = (0.02, 0.01)
"""Largest difference of the duration between motions of the same speed: as a share of it [-], or in s."""
REFERENCE = "reference_q"


@dataclass(frozen=True)
class Pair:
    """The same motion without and with a shaper."""

    unshaped: int
    """Place of the motion among those of the recording, from 0."""
    shaped: int
    shaper: str
    """Name of the shaper; empty if the recording does not say it."""
    name: str
    """The motion, by the robot's poses where it starts and ends at some: `Q1 → Q3`; else the numbers of both."""
    change: Change


def pairs(measured: Measured) -> list[Pair]:
    """Pair each unshaped motion with the same one by each shaper, in the order in which they were made.

    Motions are the same if their references before shaping start and end at the same joint angles within 0.02 rad, and
    take equally long within 2 %. Whether one was shaped is known from the recording's events, or else from its delay.
    """
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
                made.append(Pair(other, place, shaper, name, Change(*peaks, *rests)))
                break
    return sorted(made, key=lambda pair: (pair.unshaped, pair.shaped))


def _peak(measured: Measured, place: int) -> float | None:
    """Largest |α| after a motion: by the truth if it was recorded, otherwise by the sensor [m/s²]."""
    if TRUTH not in measured.recording:
        return measured.results[place].peak_m_s2
    try:
        return peak_after_stop(measured.recording, measured.motions[place])
    except NotMeasurableError:
        return None


def shaper_of(recording: Recording, motion: MotionRows, delay: float | None) -> str | None:
    """Return the name of the shaper of a motion, empty if it is not known; None if there was none.

    Args:
        recording: The recording.
        motion: One of its motions.
        delay: Time by which its target ends after its reference [ms]; None if the log has no such reference.
    """
    tick = recording["tick"][motion.start] if "tick" in recording else np.inf
    told = [one.why for one in recording.events if one.kind == "shaper_changed" and one.tick <= tick + 1]
    if told:
        name = str(told[-1]).split(" with ")[0]
        return None if name == "none" else name
    begun = "" if recording.info is None else recording.info.shaper
    return None if (delay or 0.0) < TICK_MS else begun.replace("none", "")


def _same(recording: Recording, one: MotionRows, other: MotionRows) -> bool:
    first, second = (Way.of(recording, motion, REFERENCE) for motion in (one, other))
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
