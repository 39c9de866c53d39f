"""Detect the motions in a recording."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tvist_lab.metrics.measured_motion import SMALLEST, measured_spans, servo_lag
from tvist_lab.metrics.vibration import parts
from tvist_lab.recordings import Floats, Recording

MOVING = 1e-7  # change per tick above which a reference moves [rad]
JUMP = 0.05  # change per tick above which a reference did not move but was reset; 25 rad/s [rad]
TICK = 0.002  # tick for which `JUMP` is given [s]; in logs with longer ticks a jump is larger
REST = 0.02  # a rest of the reference shorter than this, as at a reversal, belongs to the motion [s]
AT_REST = 1e-6  # target speed below which another controller's arm is at rest [rad/s]
MOSTLY = 0.98  # share of moving rows above which a target's speed must be a measured one, never zero [-]
TINY = 5e-4  # largest displacement that may be noise instead of a motion [rad]
EARLY = 0.05  # time before a motion found in measured angles that does not count as rest [s]
DIFFERENTIATOR_TICKS = 1
"""The published target of tick i is the shaped reference of tick i-1, due to the central difference."""


@dataclass(frozen=True)
class MotionRows:
    """One motion of the reference, as row indices of its recording."""

    start: int
    """Last row in which the reference has not moved yet."""
    reference_stop: int
    """Last row in which the reference before shaping moves by more than 1e-7 rad."""
    shaped_stop: int
    """Last row in which the published target moves by more than 1e-7 rad; without target, the row in which
    the measured angles come to rest."""
    end: int
    """First row after this motion: the next one's start, or the end of the recording."""
    id: Any = None
    """Number of the motion, if events contain it."""
    stopped: bool = False
    lag: float | None = None
    """Time by which the arm of another controller follows its target [s]; None if unknown."""

    def later(self, rows: int) -> "MotionRows":
        """Return the same motion in a recording with more rows before it."""
        places = ("start", "reference_stop", "shaped_stop", "end")
        return replace(self, **{name: getattr(self, name) + rows for name in places})

    def arm_stop(self, recording: Recording) -> int:
        """Return the first row from which the arm is no longer driven, but only vibrates."""
        if not self.lag:
            return self.shaped_stop
        stop = recording.time[self.shaped_stop] + self.lag
        return min(int(np.searchsorted(recording.time, stop - 1e-9)), self.end - 1)

    def duration(self, recording: Recording) -> float:
        """Return the duration of the reference before shaping [s]."""
        return float(recording.time[self.reference_stop] - recording.time[self.start])

    def shaped_duration(self, recording: Recording) -> float:
        """Return the duration of the shaped reference [s]."""
        # A shaper's first impulse has no delay, so both references start together; the tick between shaper
        # and publication is subtracted.
        published = recording.time[self.shaped_stop] - recording.time[self.start]
        return float(published - DIFFERENTIATOR_TICKS * recording.period)

    def delay(self, recording: Recording) -> float:
        """Return the paper's Δ: shaped minus unshaped duration of the reference [s], never below zero."""
        return max(self.shaped_duration(recording) - self.duration(recording), 0.0)


def motions(recording: Recording) -> list[MotionRows]:
    """Find the motions of a recording, in order.

    They come from the events `motion_started`, `motion_done` and `motion_stopped` if there are any, else from the
    reference. In a log without reference they come from the target's speed, the target or the measured angles, since
    many robots publish the measured angles as target while at rest. Motions without movement are left out, and in logs
    of other controllers those below 5 mrad where noise might look like a motion. None spans a long gap of the log.
    """
    tick, (first, *others) = recording["tick"], parts(recording.time)
    if not others:
        return _motions(recording)
    found = []
    for rows in (first, *others):
        part = recording.between(int(tick[rows.start]), int(tick[rows.stop - 1]))
        found += [motion.later(rows.start) for motion in _motions(part)]
    return found


def _motions(recording: Recording) -> list[MotionRows]:
    if len(recording) < 2:
        return []
    if "target_q" not in recording:
        return _measured_motions(recording, "actual_q")
    step = _step_per_tick(recording, "reference_q" if "reference_q" in recording else "target_q")
    jump = JUMP * recording.period / TICK if recording.foreign else JUMP
    moving = (step > MOVING) & (step <= jump)
    target_moving = _step_per_tick(recording, "target_q") > MOVING
    driven = _driven(recording)
    if driven is not None:
        moving = target_moving = driven
    spans = _spans_of_events(recording) or _spans_of_reference(recording, moving)
    if recording.foreign and "reference_q" not in recording:
        large = [span for span in spans if _displacement(recording, *span[:2]) >= SMALLEST]
        covered = sum(past - first for first, past, *_ in spans) / len(recording)
        if driven is None and (covered > MOSTLY or _trembles(recording, spans)):
            return _measured_motions(recording, "target_q")
        spans = spans if driven is None else large
    found: list[MotionRows] = []
    for lo, hi, identifier, stopped in spans:
        rows = lo + np.flatnonzero(moving[lo:hi])
        if rows.size:
            found.append(MotionRows(int(rows[0]) - 1, int(rows[-1]), 0, 0, identifier, stopped))
    jumps = np.flatnonzero(step > jump)
    for index, motion in enumerate(found):
        end = found[index + 1].start + 1 if index + 1 < len(found) else len(recording)
        end = min([end, *jumps[jumps > motion.start]])
        rows = motion.start + 1 + np.flatnonzero(target_moving[motion.start + 1 : end])
        shaped_stop = int(rows[-1]) if rows.size else motion.reference_stop
        lag = servo_lag(recording, motion.start, shaped_stop) if recording.foreign else None
        found[index] = replace(motion, shaped_stop=shaped_stop, end=int(end), lag=lag)
    return found


def _driven(recording: Recording) -> NDArray[np.bool_] | None:
    """Return where target speed is not 0, shape (T,); None unless a foreign log has one that is 0 at rest."""
    if not recording.foreign or "reference_q" in recording or "target_qd" not in recording:
        return None
    moving = np.asarray((np.abs(recording["target_qd"]) > AT_REST).any(axis=1))
    moving[0] = False
    return moving if moving.any() and np.mean(moving) < MOSTLY else None


def _displacement(recording: Recording, first: int, past: int) -> float:
    """Return the largest displacement of a joint in some rows of the target [rad]."""
    return float(np.max(np.ptp(recording["target_q"][first - 1 : past], axis=0), initial=0.0))


def _trembles(recording: Recording, spans: Sequence[tuple[int, int, Any, bool]]) -> bool:
    """Whether the target changes at rest, like measured angles: at least 2 motions and over 1/4 are tiny."""
    tiny = [_displacement(recording, *span[:2]) < TINY for span in spans]
    return sum(tiny) > max(1, len(tiny) // 4)


def _measured_motions(recording: Recording, name: str) -> list[MotionRows]:
    spans = measured_spans(recording, name)
    found = []
    for (first, last), following in zip_longest(spans, spans[1:]):
        end = len(recording)
        if following is not None:
            # A start that is detected late must not count as vibration of the earlier motion.
            end = int(np.searchsorted(recording.time, recording.time[following[0]] - EARLY))
        found.append(MotionRows(first, last, last, max(end, last + 1)))
    return found


def _step_per_tick(recording: Recording, name: str) -> Floats:
    """Return the movement per tick of the joint that moves most [rad], shape (T,); zero for the first row."""
    step = np.max(np.abs(np.diff(recording[name], axis=0)), axis=1, initial=0.0)
    return np.concatenate([[0.0], step / np.diff(recording["tick"])])


def _spans_of_events(recording: Recording) -> list[tuple[int, int, Any, bool]]:
    """Return of each motion first row, row after the last, number and whether it was stopped, from events."""
    started = [event for event in recording.events if event.kind == "motion_started"]
    ended = {event.id: event for event in recording.events if event.kind in ("motion_done", "motion_stopped")}
    spans = []
    for event, following in zip_longest(started, started[1:]):
        end = ended.get(event.id)
        # The first moving tick may be the event's own or the one after it; the same holds for the last.
        lo = max(recording.index(event.tick), 1)
        hi = len(recording) if end is None else recording.index(end.tick + 2)
        if following is not None:
            hi = min(hi, max(recording.index(following.tick), lo))
        spans.append((lo, hi, event.id, end is not None and end.kind == "motion_stopped"))
    return spans


def _spans_of_reference(recording: Recording, moving: NDArray[np.bool_]) -> list[tuple[int, int, Any, bool]]:
    """Return spans like `_spans_of_events`, from rows where the reference moves; short rests are joined."""
    rows = np.flatnonzero(moving)
    if not rows.size:
        return []
    # Between two moving rows, count the rows at rest rather than the time, since ticks may be missing in a motion.
    at_rest = recording.time[rows[1:] - 1] - recording.time[rows[:-1]]
    breaks = np.flatnonzero(at_rest > REST - 0.5 * recording.period)
    return [(int(run[0]), int(run[-1]) + 1, None, False) for run in np.split(rows, breaks + 1)]
