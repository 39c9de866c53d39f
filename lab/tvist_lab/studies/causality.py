"""Detect, before any motion, whether a shaper uses the future or remembers an earlier run."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tvist_lab.recordings import Floats
from tvist_lab.study.case import Case
from tvist_lab.study.method import Method, SampleMethod, Task
from tvist_lab.study.moves import Move
from tvist_lab.study.shaping import ShaperFaultError
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

PLACES = (0.15, 0.5, 0.8)  # times from which a second reference deviates, as shares of the motion [-]
ELSEWHERE = 1.0  # acceleration with which the second reference deviates [rad/s²]
TWICE = "gives another output when the same reference is run again: it keeps state or uses random numbers"


def inspect(method: Method, description: RobotDescription, moves: Sequence[Move]) -> str | None:
    """Return why a method cannot be ranked, found without any motion; None if there is no reason."""
    for move in moves[:2]:
        try:
            check_causal(method, Task(description, move, Case(description, move).point_to_point()))
        except ShaperFaultError as fault:
            return str(fault)
    return None


def check_causal(method: Method, task: Task) -> None:
    """Run a shaper on a reference, on others that are equal up to some tick, and on the first again.

    Raises ShaperFaultError if outputs depend on the future or earlier runs. If a method gets a move's target
    in advance, it gets the same target with every reference: it may use the target, but not the way to it.
    """
    if not isinstance(method, SampleMethod):
        return  # it plans the motion, whose end it may know
    first = _outputs(method, task)
    for place in PLACES:
        tick = int(place * len(task.reference))
        for sign in (1.0, -1.0):
            other = _outputs(method, _elsewhere(method, task, tick, sign))
            apart = np.flatnonzero((first[: tick + 1] != other[: tick + 1]).any(axis=1))
            if apart.size:
                raise ShaperFaultError(
                    f"uses future samples: references that are equal up to tick {tick} give other outputs from tick "
                    f"{apart[0]} on"
                )
    if not np.array_equal(first, _outputs(method, task)):
        raise ShaperFaultError(TWICE)


def _outputs(method: SampleMethod, task: Task) -> Floats:
    stepper = method.stepper(task)
    return np.array([stepper.step(sample) for sample in task.reference])


def _elsewhere(method: Method, task: Task, tick: int, sign: float) -> Task:
    """Return the task with a reference that deviates from the first one on a parabola after a tick."""
    reference = task.reference.copy()
    late = PERIOD * np.arange(1, len(reference) - tick)
    reference[tick + 1 :] += sign * 0.5 * ELSEWHERE * late[:, None] ** 2
    told = task.move.target if method.needs_target else tuple(reference[-1].tolist())
    return replace(task, reference=reference, move=replace(task.move, target=told))
