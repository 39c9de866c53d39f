"""Check of causality: references that differ only after some tick must give equal outputs up to that tick.

A candidate that is given the target of a move in advance gets the same target with every reference: it may know where
the move was to end, but no more of the way there than other candidates.
"""

from dataclasses import replace

import numpy as np

from tvist_lab.evaluation.candidates import Candidate, Task
from tvist_lab.evaluation.running import RunningShaper
from tvist_lab.evaluation.sound import ShaperFaultError
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD

PLACES = (0.15, 0.5, 0.8)
"""Positions after which the references differ, as shares of the motion [-]."""
ELSEWHERE = 1.0
"""Acceleration with which the other reference deviates [rad/s²]."""
TWICE = "gives another output when the same reference is run again: it keeps something, or draws by chance"


def check_causal(candidate: Candidate, task: Task) -> None:
    """Run a shaper on a reference, on others with the same beginning, and again on the first one.

    A shaper that remembers a reference, or reads it where it is stored, gives different outputs for a different
    future.

    Raises:
        ShaperFaultError: It does so, or the same reference gives a different output the second time.
    """
    first = _outputs(candidate, task)
    if first is None:
        return
    for place in PLACES:
        tick = int(place * len(task.reference))
        for sign in (1.0, -1.0):
            other = _outputs(candidate, _elsewhere(candidate, task, tick, sign))
            assert other is not None
            apart = np.flatnonzero((first[: tick + 1] != other[: tick + 1]).any(axis=1))
            if apart.size:
                raise ShaperFaultError(
                    f"peeks at the future: references that are equal up to tick {tick} give other outputs from tick "
                    f"{apart[0]} on"
                )
    again = _outputs(candidate, task)
    assert again is not None
    if not np.array_equal(first, again):
        raise ShaperFaultError(TWICE)


def _outputs(candidate: Candidate, task: Task) -> Floats | None:
    stepper: RunningShaper | None = candidate.stepper(task)
    return None if stepper is None else np.array([stepper.step(sample) for sample in task.reference])


def _elsewhere(candidate: Candidate, task: Task, tick: int, sign: float) -> Task:
    """Return the task with a reference that deviates from the first one on a parabola after a tick.

    A candidate that is given the target still gets that of the first reference.
    """
    reference = task.reference.copy()
    late = PERIOD * np.arange(1, len(reference) - tick)
    reference[tick + 1 :] += sign * 0.5 * ELSEWHERE * late[:, None] ** 2
    told = task.move.target if candidate.told_target else tuple(reference[-1].tolist())
    return replace(task, reference=reference, move=replace(task.move, target=told))
