"""Find in logs of a robot's motions which modes vibrate after stops, and recommend a shaper."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import numpy as np

from tvist_lab.advice.options import EACH, ONE, ROBOT, Option, options, slowed, smoothed
from tvist_lab.advice.stops import StopWithRest, grouped
from tvist_lab.metrics import MeasuredRecording, NotMeasurableError, shaper_of
from tvist_lab.metrics.agreed_modes import SAME_MODE, agreed_modes
from tvist_lab.metrics.measured_motion import still_driven
from tvist_lab.metrics.ring_down import SKIP, WINDOWS
from tvist_lab.recordings.recording import MissingColumnError

EARLY = 0.15  # accepted settling time beyond the shortest one, as a share of that without a shaper [-]
CLOSE = 5.0  # vibration that a shaper may leave beyond what the best one leaves [percentage points]
SIMPLE = (ROBOT, ONE, EACH)  # where modes can come from, the simplest first
RIPPLES = ("actual_qd", "actual_current", "actual_moment", "actual_q")
"""Columns in which vibration of the arm may be visible in a joint."""
LIGHTEST = 0.005  # smallest damping ratio of an arm [-]; a signal with less is interference in the sensor
AGREED = 2  # smallest number of motions that must show the same frequency


class RingingMode(NamedTuple):
    """A mode that several motions share."""

    f_d: float
    """Median of the damped frequencies [Hz]."""
    f_d_interval: tuple[float, float]
    """From the lowest to the highest end of the motions' 95 % intervals [Hz]."""
    zeta: float
    """Median of the damping ratios [-]."""
    zeta_interval: tuple[float, float]
    """From the lowest to the highest end of the motions' 95 % intervals [-]."""
    motions: int
    """Number of motions after which the mode vibrates."""
    amplitude: float
    """Largest |α| of the mode at a stop [m/s²]."""


@dataclass(frozen=True)
class Advice:
    """Vibration found in logs, and the recommended shaper."""

    ringing: Sequence[StopWithRest]
    """Unshaped stops whose vibration stands out."""
    quiet: Sequence[StopWithRest]
    """Unshaped stops without noticeable vibration."""
    shaped: Sequence[tuple[int, int, str]]
    """Motions already shaped: index of the file, number in the file, and the shaper's name if known."""
    refused: Sequence[tuple[int, int, str]]
    """Motions that could not be measured: index of the file, number in the file, and the reason."""
    modes: Sequence[RingingMode]
    """Modes that vibrate after stops; the one found in most motions comes first."""
    options: Sequence[Option]
    """All shapers, by settling time."""
    best: Option | None
    """Best shaper; None if none helps."""
    smoothed_percent: float | None = None
    """Vibration left by a running mean as long as the best shaper, median [%]."""
    slowed_percent: float | None = None
    """Vibration that slower limits with the same added time would leave, according to the modes, median [%]."""
    weak: tuple[float, int] | None = None
    """If logs lack tool acceleration: frequency seen in the joints [Hz], and number of motions showing it."""

    @property
    def still_s(self) -> float:
        """Median settling time of the tool without a shaper [s]; infinite if recorded rests are too short."""
        return median(one.unshaped.still for one in self.ringing)


def advise(logs: Sequence[MeasuredRecording]) -> Advice:
    """Recommend a shaper from logs of one robot."""
    stops, shaped, refused = _sorted_out(logs)
    loud = [one for one in stops if one.rings]
    quiet = [one for one in stops if not one.rings]
    weak = frequency_of_joints(logs) if not stops and not shaped else None
    if not loud:
        return Advice((), quiet, shaped, refused, (), (), None, weak=weak)
    found = sorted(options(loud), key=lambda one: (one.still_s, one.left_percent))
    best = recommended(found, median(one.unshaped.still for one in loud))
    smooth = slow = None
    if best is not None:
        smooth = _median(smoothed(one, best.added[one]) for one in loud)
        slow = _median(slowed(one, best.added[one]) for one in loud)
    return Advice(loud, quiet, shaped, refused, ringing_modes(loud), found, best, smooth, slow)


def _sorted_out(
    logs: Sequence[MeasuredRecording],
) -> tuple[list[StopWithRest], list[tuple[int, int, str]], list[tuple[int, int, str]]]:
    """Return unshaped stops, motions that had a shaper, and motions that cannot be measured."""
    stops, shaped, refused = [], [], []
    for file, log in enumerate(logs):
        for place, motion in enumerate(log.motions):
            shaper = shaper_of(log.recording, motion, log.results[place].delay_ms)
            if shaper is not None:
                shaped.append((file, place + 1, shaper))
                continue
            if motion.stopped:
                refused.append((file, place + 1, "it was stopped before its target"))
                continue
            try:
                stops.append(StopWithRest.of(log, place, file))
            except NotMeasurableError as error:
                refused.append((file, place + 1, str(error)))
            except MissingColumnError as error:
                refused.append((file, place + 1, f"the log has no {error.column}"))
    return grouped(stops), shaped, refused


def recommended(found: Sequence[Option], still: float) -> Option | None:
    """Choose among shapers that keep the limits; `still` is the settling time without a shaper [s]."""
    # Among those that settle about as early as the earliest and leave about as little as the best, take the
    # one that depends least on the modes, then the shortest.
    fair = [one for one in found if one.keeps_limits and one.left_percent < 100.0 - CLOSE]
    if not fair:
        return None
    earliest = min(one.still_s for one in fair)
    fair = [one for one in fair if one.still_s <= earliest + (EARLY * still if still < float("inf") else 0.0)]
    least = min(one.left_percent for one in fair)
    fair = [one for one in fair if one.left_percent <= least + CLOSE]
    return min(fair, key=lambda one: (SIMPLE.index(one.aim.scope), one.added_s, one.left_percent))


def ringing_modes(stops: Sequence[StopWithRest]) -> list[RingingMode]:
    """Group modes of stops if their frequencies differ by up to 7 %, the mode found in most motions first."""
    pool = [(place, mode) for place, one in enumerate(stops) for mode in one.result.modes]
    found = []
    while pool:
        near = [
            [one for one in pool if abs(one[1]["f_d_hz"] / middle["f_d_hz"] - 1.0) <= SAME_MODE]
            for _, middle in pool
        ]
        group = max(
            near, key=lambda one: (len({place for place, _ in one}), max(m["amplitude"] for _, m in one))
        )
        pool = [one for one in pool if one not in group]
        modes = [mode for _, mode in group]
        ends = [
            (min(mode[name][0] for mode in modes), max(mode[name][1] for mode in modes))
            for name in ("interval", "zeta_interval")
        ]
        f_d, zeta = (median(mode[name] for mode in modes) for name in ("f_d_hz", "zeta"))
        count = len({place for place, _ in group})
        found.append(
            RingingMode(f_d, ends[0], zeta, ends[1], count, max(mode["amplitude"] for mode in modes))
        )
    return found


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None


def frequency_of_joints(logs: Sequence[MeasuredRecording]) -> tuple[float, int] | None:
    """Return f_d [Hz] seen in encoders or currents after stops, and the number of motions that show this f_d.

    This is weak evidence, since joints hardly feel the tool. None if no two motions agree within 7 %.
    """
    seen = [(place, f_d) for place, found in enumerate(_swings(logs)) for f_d in found]
    groups = [[one for one in seen if abs(one[1] / middle - 1.0) <= SAME_MODE] for _, middle in seen]
    best = max(groups, key=lambda group: len({place for place, _ in group}), default=[])
    count = len({place for place, _ in best})
    return (median(f_d for _, f_d in best), count) if count >= AGREED else None


def _swings(logs: Sequence[MeasuredRecording]) -> Iterator[list[float]]:
    """Yield the frequencies that the joints show after each motion [Hz]."""
    for log in logs:
        recording = log.recording
        for motion in log.motions:
            stop = motion.arm_stop(recording)
            time = recording.time[stop : motion.end] - recording.time[stop]
            begin = max(SKIP, still_driven(recording, motion.start, stop))
            found = []
            for name in filter(recording.__contains__, RIPPLES):
                values = recording[name][stop : motion.end]
                shown = np.isfinite(values).all(axis=1)
                if not shown.any() or time[shown][-1] < begin + WINDOWS[0]:
                    continue
                swing = values[shown] - values[shown][-len(values) // 3 :].mean(axis=0)
                fit = agreed_modes(swing, time[shown], recording.period, begin)
                found += [fit.f_d] if fit.ok and fit.zeta > LIGHTEST else []
            yield found
