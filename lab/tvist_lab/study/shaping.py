"""Apply a shaper to one reference until it ends, and check for hidden motion."""

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tvist_controller.api.line import STILL, ElasticFeedForward
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

LONGEST = 3.0  # time after the reference's end within which a shaped reference must end [s]
ENDED = 10  # number of ticks at the target after which the output has ended
WATCHED = 0.5  # time for which the output is checked for a tail after it has ended [s]
TAIL = 1e-6  # largest distance from the target or the final sample that does not count as a tail [rad]
SLACK = 3  # ticks by which the end may be later than declared, due to interpolation
WARM = 20  # number of first ticks whose processing time is ignored, since they may compile code


class ShaperFaultError(Exception):
    """A shaper's output is no valid shaped reference; the message tells why."""


@dataclass(frozen=True)
class Shaped:
    """A shaped reference, and the feed-forward to follow it."""

    q: Floats  # samples up to the end and a few ticks more, shape (T', n) [rad]
    delay: float = 0.0  # time from the reference's end to the output's, at most the declared delay [s]
    cost: float | None = None  # measured processor time per tick [s]
    elastic: ElasticFeedForward | None = None
    """Elastic feed-forward for the drives; None for that of the paper's controller."""
    law: Floats | None = None  # friction to feed forward; None for that of the unshaped motion
    ended: bool = True  # whether the shaped reference came to rest at the target


class RunningShaper(Protocol):
    """A shaper in operation on one reference."""

    def step(self, q: Floats) -> Floats:
        """Return the next sample, shape (n,) [rad]."""

    @property
    def delay(self) -> float | None:
        """Time over which the last output depends on the past [s]; None if not declared."""


class RunningFilter:
    """A filter in operation; if its shaper's function fails, it fails too, so no result has old weights."""

    def __init__(self, tvist: Filter) -> None:
        self._tvist = tvist

    @property
    def delay(self) -> float:
        """Delay of the last output [s]."""
        return self._tvist.delay

    def step(self, q: Floats) -> Floats:
        """Return the next shaped sample, shape (n,) [rad]."""
        return self._checked(self._tvist.filter(q))

    def all(self, q: Floats) -> Floats:
        """Return the next shaped samples, shape (T, n) [rad]: those of `step`, but faster."""
        return self._checked(self._tvist.filter_all(q))

    def _checked(self, shaped: Floats) -> Floats:
        if self._tvist.fault is not None:
            raise ShaperFaultError(self._tvist.fault)
        return shaped


def shape(stepper: RunningShaper, reference: Floats, *, watched: bool) -> Shaped:
    """Apply a shaper to a reference, at rest at both ends, until the output rests at the target."""
    # With `watched`, measure the shaper's processor time, and raise ShaperFaultError unless the output ends,
    # keeps the declared delay, and does not move again later.
    target, stop = reference[-1], len(reference) - 1
    q, cost = _through(stepper, reference, timed=watched)
    declared = [stepper.delay]
    quiet = 0
    while quiet < ENDED and len(q) <= stop + LONGEST / PERIOD:
        q.append(stepper.step(target))
        declared.append(stepper.delay)
        moved = np.abs(q[-1] - q[-2]).max()
        quiet = quiet + 1 if max(moved, np.abs(q[-1] - target).max()) <= STILL else 0
    own = max(len(q) - ENDED - 1 - stop, 0) * PERIOD
    if watched:
        if quiet < ENDED:
            away = float(np.abs(q[-1] - target).max())
            raise ShaperFaultError(
                f"does not end: {1e3 * LONGEST:.0f} ms after the reference it is {away:.2g} rad from the target"
            )
        _check_tail(stepper, target)
        _check_word(q, stop, declared, own)
    said = declared[0]
    return Shaped(np.array(q), own if said is None else min(own, max(said, 0.0)), cost, ended=quiet >= ENDED)


def _through(stepper: RunningShaper, reference: Floats, *, timed: bool) -> tuple[list[Floats], float | None]:
    """Shape a reference; return the samples and, if `timed`, the processor time per tick [s]."""
    if not timed and isinstance(stepper, RunningFilter):
        return list(stepper.all(reference)), None
    warm = min(WARM, len(reference) - 1)
    q = [stepper.step(sample) for sample in reference[:warm]]
    began = time.thread_time()
    q += [stepper.step(sample) for sample in reference[warm:]]
    return q, (time.thread_time() - began) / (len(reference) - warm)


def _check_tail(stepper: RunningShaper, target: Floats) -> None:
    """Continue for a while, and check that the output stays at the target."""
    for late in range(round(WATCHED / PERIOD)):
        away = float(np.abs(stepper.step(target) - target).max())
        if away > TAIL:
            after = 1e3 * PERIOD * (late + ENDED)
            raise ShaperFaultError(
                f"moves after its end: {after:.0f} ms later it is {away:.2g} rad from the target"
            )


def _check_word(q: list[Floats], stop: int, declared: list[float | None], own: float) -> None:
    """Check that the output does not move for longer than declared at each tick."""
    for late, said in enumerate(declared):
        if said is None or late * PERIOD <= said + SLACK * PERIOD:
            continue
        moved = float(np.abs(q[stop + late] - q[-1]).max())
        if moved > TAIL:
            raise ShaperFaultError(
                f"moves after its declared end: it declares a delay of {1e3 * said:.0f} ms, and ends "
                f"{1e3 * own:.0f} ms after the reference, {moved:.2g} rad further"
            )
        return
