"""A shaper on one reference: run to its end, and watched for what it hides."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tvist_controller.api import STILL
from tvist_lab.evaluation.line import LONGEST
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

WATCHED = 0.5
"""Time for which a shaped reference that has ended is watched for a tail [s]."""
TAIL = 1e-6
"""So far it may move in that time, or stay away from the target [rad]."""
SLACK = 3
"""Ticks by which a shaper may end later than it declares: interpolation takes samples on both sides."""
WARM = 20
"""First ticks of a reference, whose time does not count: they may compile."""
ENDED = 10
"""So many ticks at the target are an end."""


class ShaperFaultError(Exception):
    """A shaper cannot be ranked; the sentence says why."""


@dataclass(frozen=True)
class Shaped:
    """What a shaper made of a reference."""

    q: Floats
    """Shape (T', n), up to the end and a few ticks more [rad]."""
    delay: float
    """From the reference's end to its own, but no more than it declared [s]."""
    cost: float | None
    """Processor time of a tick, as it happened to take [s]."""


class RunningShaper(Protocol):
    """A shaper at work on one reference."""

    def step(self, q: Floats) -> Floats:
        """The next sample, shape (n,) [rad]."""

    @property
    def delay(self) -> float | None:
        """By which its last output is spread over the past [s]; None where it does not say."""


def sound(tvist: Filter) -> Callable[[Floats], Floats]:
    """Shape by a filter for as long as its shaper's function gives weights: no figure may come from old ones.

    Returns:
        Sample to shaped sample; raises `ShaperFaultError` where the function fails.
    """

    def step(q: Floats) -> Floats:
        shaped = tvist.filter(q)
        if tvist.fault is not None:
            raise ShaperFaultError(tvist.fault)
        return shaped

    return step


def run(stepper: RunningShaper, reference: Floats) -> Shaped:
    """Feed a reference to a shaper, let it end, and watch it for a while.

    Raises:
        ShaperFaultError: It does not end at the target, or goes on after its end or its declared delay.
    """
    target, stop = reference[-1], len(reference) - 1
    warm = min(WARM, stop)
    q = [stepper.step(sample) for sample in reference[:warm]]
    began = time.thread_time()
    q += [stepper.step(sample) for sample in reference[warm:]]
    cost = (time.thread_time() - began) / (len(reference) - warm)
    declared = [stepper.delay]
    quiet = 0
    while quiet < ENDED:
        if len(q) > stop + LONGEST / PERIOD:
            away = float(np.abs(q[-1] - target).max())
            raise ShaperFaultError(
                f"does not end: {1e3 * LONGEST:.0f} ms after the reference it is {away:.2g} rad from the target"
            )
        q.append(stepper.step(target))
        declared.append(stepper.delay)
        moved = np.abs(q[-1] - q[-2]).max()
        quiet = quiet + 1 if max(moved, np.abs(q[-1] - target).max()) <= STILL else 0
    end = len(q) - ENDED - 1
    for late in range(round(WATCHED / PERIOD)):
        away = float(np.abs(stepper.step(target) - target).max())
        if away > TAIL:
            after = 1e3 * PERIOD * (late + ENDED)
            raise ShaperFaultError(
                f"hides a tail: {after:.0f} ms after it seemed to have ended it is {away:.2g} rad from the target"
            )
    own = max(end - stop, 0) * PERIOD
    _keep_word(q, stop, declared, own)
    said = declared[0]
    return Shaped(np.array(q), own if said is None else min(own, max(said, 0.0)), cost)


def _keep_word(q: list[Floats], stop: int, declared: list[float | None], own: float) -> None:
    """Check that nothing moves later than was declared at that tick."""
    for late, said in enumerate(declared):
        if said is None or late * PERIOD <= said + SLACK * PERIOD:
            continue
        moved = float(np.abs(q[stop + late] - q[-1]).max())
        if moved > TAIL:
            raise ShaperFaultError(
                f"hides a tail: it declares a delay of {1e3 * said:.0f} ms, and ends {1e3 * own:.0f} ms after the "
                f"reference, {moved:.2g} rad further"
            )
        return
