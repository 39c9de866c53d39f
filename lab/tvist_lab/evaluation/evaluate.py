"""Evaluation of moves, each unshaped and shaped, and its summary."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tvist_controller.api import MotionLimits
from tvist_lab.evaluation.baselines import Baseline
from tvist_lab.evaluation.conditions import AS_KNOWN, Conditions
from tvist_lab.evaluation.line import PAPER
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.trial import Trial
from tvist_lab.metrics import (
    NotMeasurableError,
    motions,
    peak_acceleration,
    peak_after_stop,
    peak_velocity,
    still_after,
)
from tvist_lab.metrics.common_clock import AFTER_STOP, STILL, peak_later_than
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.recordings import Floats, Recording
from tvist_lab.runners import Processes, Runner, in_order
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

WORTH = 0.2
"""Unshaped peak [m/s²] below which a move has no vibration to reduce, so that it is listed but not in percentages."""
QUIET = 0.02
"""A lower threshold of the acceleration below which an arm is still [m/s²]."""
RESAMPLED = 2000
"""Number of bootstrap samples for an interval."""
AT_ONCE = 8
"""Motions that a process makes before it returns results; less than twice as many do not justify another process."""


@dataclass(frozen=True)
class MoveJob:
    """One move and the ways to make it."""

    description: RobotDescription
    """The arm, and the controller's model of it."""
    move: Move
    recipe: Recipe
    baselines: tuple[Baseline, ...] = ()
    """Baselines to run as well."""
    seed: int = 0
    """Seed of gear errors, and of the arm's deviations."""
    conditions: Conditions = AS_KNOWN
    """Limits, and what the controller does not know."""
    stream: bool = False
    """Whether to follow a stream from the move's start that is stopped somewhere, instead of making the move."""

    @property
    def motions(self) -> int:
        """Number of motions: unshaped, shaped, and one for each baseline."""
        return 2 + len(self.baselines)


@dataclass(frozen=True)
class Made:
    """One move made in one way."""

    peak: float
    """Largest true |α| later than 10 ms after the reference stops [m/s²]."""
    duration: float
    """Duration of the shaped reference [s]."""
    still_after: float | None
    """Time until still, from the start of the unshaped reference [s]; None if not still at the end of the recording."""
    quiet_after: float | None
    """Time until |α| stays below 0.02 m/s², likewise [s]."""
    acceleration: float
    """Largest |q̈*| relative to the limit of the unshaped reference [-]."""
    velocity: float
    """Largest |q̇*| relative to the limit of the unshaped reference [-]."""
    waited: float
    """Largest true |α| of the unshaped motion later than 10 ms after this one's stop [m/s²]."""


@dataclass(frozen=True)
class JudgedMove:
    """One move made in every way."""

    unshaped: Made
    shaped: Made
    baselines: dict[str, Made] = field(default_factory=dict)
    """Results of the baselines, by name."""

    @property
    def counts(self) -> bool:
        """Whether there is enough vibration for a percentage."""
        return self.unshaped.peak >= WORTH

    def reduction(self, made: Made) -> float:
        """Reduction of the peak compared with the unshaped move [%]."""
        return 100.0 * (1.0 - made.peak / self.unshaped.peak)

    def reduction_by_waiting(self, made: Made) -> float:
        """Reduction of the peak compared with an unshaped arm that waits equally long [%]."""
        return 100.0 * (1.0 - made.peak / made.waited)

    def delay(self, made: Made) -> float:
        """Extra duration of the reference compared with the unshaped one [ms]."""
        return round(1e3 * (made.duration - self.unshaped.duration), 6)


def record(job: MoveJob) -> tuple[Recording, Recording]:
    """Record a move unshaped and shaped, on the same arm with the same seed."""
    unshaped, shaped, _ = _record(job)
    return unshaped, shaped


def judge(job: MoveJob) -> JudgedMove:
    """Make a move in every way, and measure it."""
    unshaped, shaped, others = _record(job)
    return JudgedMove(
        measured(unshaped, limits=job.conditions.limits),
        measured(shaped, unshaped, limits=job.conditions.limits),
        {name: measured(other, unshaped, limits=job.conditions.limits) for name, other in others.items()},
    )


def arm_seed(seed: int, place: int) -> int:
    """Return the seed of gear errors for the move at a place, so that each move has its own."""
    return (1_000_003 * seed + place) % 2**63


def evaluate(jobs: Sequence[MoveJob], runner: Runner | None = None) -> Iterator[JudgedMove]:
    """Judge all jobs; yield the results in order, each as soon as it is available.

    Args:
        jobs: The moves.
        runner: What runs the jobs; None for all cores of this machine.
    """
    motions = max((job.motions for job in jobs), default=1)
    here = Processes(few=2 * AT_ONCE // motions, chunk=max(AT_ONCE // motions, 1))
    return in_order(runner or here, judge, jobs)


def measured(
    recording: Recording, unshaped: Recording | None = None, *, limits: MotionLimits = PAPER
) -> Made:
    """Measure the one motion of a recording.

    Args:
        recording: The recording.
        unshaped: Recording of the same motion unshaped, which is waited with; None for the first one itself.
        limits: Limits of the unshaped reference.
    """
    unshaped = unshaped or recording
    motion, waiting = motions(recording)[0], motions(unshaped)[0]
    stop = recording.time[motion.shaped_stop] + AFTER_STOP
    return Made(
        peak=peak_after_stop(recording, motion),
        duration=motion.shaped_duration(recording),
        still_after=_still_after(recording, motion, STILL),
        quiet_after=_still_after(recording, motion, QUIET),
        acceleration=peak_acceleration(recording, motion) / limits.acceleration,
        velocity=peak_velocity(recording, motion) / limits.velocity,
        waited=peak_later_than(unshaped, waiting, min(stop, unshaped.time[-2])),
    )


def _still_after(recording: Recording, motion: MotionRows, threshold: float) -> float | None:
    try:
        return still_after(recording, motion, threshold)
    except NotMeasurableError:
        return None


def _record(job: MoveJob) -> tuple[Recording, Recording, dict[str, Recording]]:
    trial = Trial(job.description, job.move, job.seed, job.conditions, stream=job.stream)
    shaped = trial.shaped(job.recipe)
    ticks = round(motions(shaped)[0].shaped_duration(shaped) / PERIOD)
    others = {baseline.name: trial.baseline(baseline, job.recipe, ticks) for baseline in job.baselines}
    return trial.unshaped(), shaped, others


def report(jobs: Sequence[MoveJob], judged: Sequence[JudgedMove]) -> dict[str, Any]:
    """Return the part of `tvist evaluate --json` about the moves."""
    counted = [one for one in judged if one.counts]
    rows = [_row(job, one) for job, one in zip(jobs, judged, strict=True)]
    names = judged[0].baselines if judged else {}
    return {
        "moves": rows,
        "counted": len(counted),
        "left_out": [number for number, one in enumerate(judged, 1) if not one.counts],
        **_summary([(one, one.shaped) for one in judged]),
        "baselines": {
            "waiting": _summary([(one, one.unshaped) for one in judged]),
            **{name: _summary([(one, one.baselines[name]) for one in judged]) for name in names},
        }
        if names
        else {},
    }


def _row(job: MoveJob, one: JudgedMove) -> dict[str, Any]:
    return {
        "payload_kg": job.move.mass,
        "unshaped_peak_m_s2": one.unshaped.peak,
        "shaped_peak_m_s2": one.shaped.peak,
        "reduction_percent": one.reduction(one.shaped) if one.counts else None,
        "delay_ms": one.delay(one.shaped),
        "still_after_ms": {"unshaped": _ms(one.unshaped.still_after), "shaped": _ms(one.shaped.still_after)},
        "peak_acceleration_ratio": one.shaped.acceleration,
        "peak_velocity_ratio": one.shaped.velocity,
        **(
            {
                "baselines": {
                    name: {
                        "peak_m_s2": made.peak,
                        "reduction_percent": one.reduction(made) if one.counts else None,
                        "delay_ms": one.delay(made),
                        "still_after_ms": _ms(made.still_after),
                    }
                    for name, made in one.baselines.items()
                }
            }
            if one.baselines
            else {}
        ),
    }


def _summary(pairs: list[tuple[JudgedMove, Made]]) -> dict[str, Any]:
    """Summarize one way over all moves; reductions only over moves that count."""
    reductions = np.array([one.reduction(made) for one, made in pairs if one.counts])
    delays = np.array([one.delay(made) for one, made in pairs])
    accelerations, velocities = np.array([[made.acceleration, made.velocity] for _, made in pairs]).T
    quiet = [made.peak for one, made in pairs if not one.counts]
    # Count the time until still from the stop of the unshaped reference, since the lengths of moves differ.
    late, later = (
        [round(1e3 * (at - one.unshaped.duration), 6) for one, at in times if at is not None]
        for times in (
            [(one, made.still_after) for one, made in pairs],
            [(one, made.quiet_after) for one, made in pairs],
        )
    )
    waiting = np.array([one.reduction_by_waiting(made) for one, made in pairs if one.counts])
    return {
        "peak_m_s2": _of(
            np.array([made.peak for one, made in pairs if one.counts]), median=50, p95=95, max=100
        ),
        "reduction_percent": _of(reductions, median=50, p5=5, min=0),
        "reduction_percent_interval": {
            name: interval(reductions, share) for name, share in (("median", 50), ("p5", 5))
        },
        "delay_ms": _of(delays, median=50, max=100),
        "peak_acceleration_ratio": _of(accelerations, median=50, p90=90, max=100),
        "peak_velocity_ratio": _of(velocities, median=50, p90=90, max=100),
        "less_than_waiting_percent": _of(waiting, median=50, p5=5, min=0),
        "still_after_unshaped_stop_ms": _of(np.array(late), median=50, p90=90, max=100),
        "quiet_after_unshaped_stop_ms": _of(np.array(later), median=50, p90=90, max=100),
        "never_still": len(pairs) - len(late),
        "left_out_largest_peak_m_s2": max(quiet, default=None),
    }


def interval(values: Floats, percentile: float) -> list[float] | None:
    """95 % bootstrap interval of a percentile; None if there are no values."""
    if not values.size:
        return None
    random = np.random.default_rng(0)
    drawn = values[random.integers(0, values.size, (RESAMPLED, values.size))]
    low, high = np.percentile(np.percentile(drawn, percentile, axis=1), [2.5, 97.5])
    return [float(low), float(high)]


def _of(values: Floats, **percentiles: float) -> dict[str, float | None]:
    return {
        name: float(np.percentile(values, share)) if values.size else None
        for name, share in percentiles.items()
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1e3 * seconds, 6)
