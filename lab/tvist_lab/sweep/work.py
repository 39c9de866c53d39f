"""What a worker does: make a move with every shaper, and measure each as `tvist evaluate` does."""

import os
import platform
import time
from dataclasses import dataclass
from typing import Any

from tvist_lab.evaluation.conditions import torque_share
from tvist_lab.evaluation.evaluate import JudgedMove, Made, measured
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.sound import ShaperFaultError
from tvist_lab.evaluation.trial import Trial
from tvist_lab.recordings import Recording
from tvist_lab.runners import TaskError
from tvist_lab.sweep.columns import FAILED, MEASURED, TOO_WEAK, Row
from tvist_lab.sweep.tasks import SweepTask
from tvist_lab.words import named


@dataclass(frozen=True)
class TaskRows:
    """The rows of a task, and the time that it took."""

    rows: tuple[Row, ...]
    worker: str
    """Host and process that did it."""
    began: float
    """Start on that host's monotonic clock [s]."""
    ended: float
    """End on the same clock [s]."""


def measure(task: SweepTask) -> TaskRows:
    """Make the move of a task with every shaper; a shaper that fails costs its own row alone."""
    began = time.monotonic()
    rows = tuple(_measured(task))
    return TaskRows(rows, f"{platform.node()}:{os.getpid()}", began, time.monotonic())


def failed(task: SweepTask, status: str, why: str) -> list[Row]:
    """Return the rows of a task that measures nothing."""
    return [_row(task, place, status=status, error=why) for place in range(len(task.shapers))]


def why(error: Exception) -> str:
    """Return an error in one line."""
    return str(error) if isinstance(error, TaskError) else named(error)


def _measured(task: SweepTask) -> list[Row]:
    try:
        share = 0.0 if task.stream else torque_share(task.description, task.move, task.conditions.limits)
        if share > 1.0:
            return failed(task, TOO_WEAK, f"the move needs {100.0 * share:.0f} % of a drive's torque")
        trial = Trial(task.description, task.move, task.seed, task.conditions, stream=task.stream)
        plain = trial.unshaped()
        unshaped = measured(plain, limits=task.conditions.limits)
    except Exception as error:  # noqa: BLE001  it costs these rows alone
        return failed(task, FAILED, why(error))
    return [_shaped(task, place, recipe, trial, plain, unshaped) for place, recipe in enumerate(task.recipes)]


def _shaped(
    task: SweepTask, place: int, recipe: Recipe, trial: Trial, plain: Recording, unshaped: Made
) -> Row:
    try:
        shaped = measured(trial.shaped(recipe), plain, limits=task.conditions.limits)
        return _row(task, place, status=MEASURED, **_figures(JudgedMove(unshaped, shaped)))
    except ShaperFaultError as fault:
        return _row(task, place, status=FAILED, error=f"the shaper {fault}")
    except Exception as error:  # noqa: BLE001  it costs this row alone
        return _row(task, place, status=FAILED, error=why(error))


def _figures(one: JudgedMove) -> Row:
    unshaped, shaped = one.unshaped, one.shaped
    return {
        "unshaped_peak_m_s2": unshaped.peak,
        "shaped_peak_m_s2": shaped.peak,
        "reduction_percent": one.reduction(shaped) if one.counts else None,
        "less_than_waiting_percent": one.reduction_by_waiting(shaped) if one.counts else None,
        "delay_ms": one.delay(shaped),
        "unshaped_duration_ms": _ms(unshaped.duration),
        "unshaped_still_after_ms": _ms(unshaped.still_after),
        "shaped_still_after_ms": _ms(shaped.still_after),
        "peak_acceleration_ratio": shaped.acceleration,
        "peak_velocity_ratio": shaped.velocity,
    }


def _row(task: SweepTask, place: int, **results: Any) -> Row:
    return {
        "row": task.position * len(task.shapers) + place,
        "robot": task.robot,
        "payload": task.payload,
        "payload_error_percent": task.mistakes.payload,
        "stiffness_error_percent": task.mistakes.stiffness,
        "frequency_error_percent": task.mistakes.frequency,
        "move": task.number,
        "shaper": task.shapers[place],
        "seed": task.seed,
        "payload_kg": task.move.mass,
        "start": list(task.move.start),
        "target": list(task.move.target),
        **results,
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1e3 * seconds, 6)
