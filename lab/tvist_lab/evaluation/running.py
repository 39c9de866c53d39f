"""A shaper applied to one reference until it ends, with checks for hidden motion."""

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tvist_controller.api import STILL
from tvist_lab.evaluation.line import LONGEST
from tvist_lab.evaluation.sound import ShaperFaultError
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD

WATCHED = 0.5
"""Time for which the output is checked for a tail after it has ended [s]."""
TAIL = 1e-6
"""Largest motion in that time, and largest distance from the target [rad]."""
SLACK = 3
"""Ticks by which a shaper may end later than declared, since interpolation uses samples on both sides."""
WARM = 20
"""Number of first ticks whose processing time is ignored, since they may compile code."""
ENDED = 10
"""Number of ticks at the target after which the output has ended."""


@dataclass(frozen=True)
class Shaped:
    """Result of shaping a reference."""

    q: Floats
    """Samples up to the end and a few ticks more, shape (T', n) [rad]."""
    delay: float
    """Time from the reference's end to the output's, limited to the declared delay [s]."""
    cost: float | None
    """Measured processor time per tick [s]."""


class RunningShaper(Protocol):
    """A shaper in operation on one reference."""

    def step(self, q: Floats) -> Floats:
        """Return the next sample, shape (n,) [rad]."""

    @property
    def delay(self) -> float | None:
        """Time over which the last output depends on the past [s]; None if the shaper does not declare it."""


def run(stepper: RunningShaper, reference: Floats) -> Shaped:
    """Apply a shaper to a reference until it ends, and monitor it for a while after that.

    Raises:
        ShaperFaultError: It does not end at the target, or moves after its end or its declared delay.
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
    """Check that the output does not move for longer than was declared at each tick."""
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
