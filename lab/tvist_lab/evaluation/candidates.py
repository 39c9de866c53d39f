"""What is judged on the bench: filters by name, baselines, and shapers from a person's own file."""

import importlib.util
import inspect
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tvist_lab.evaluation.baselines import Baseline
from tvist_lab.evaluation.line import LONGEST, PAPER, lengthened
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.values import Payload
from tvist_server.cycle import STILL
from tvist_server.setup import paper_payload
from tvist_server.trajectory import Limits
from tvist_shaping.base import Filter
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

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
MODES = 4
"""That are told to a shaper from a file."""


class ShaperFaultError(Exception):
    """A shaper cannot be ranked; the sentence says why."""


class CandidateError(ValueError):
    """A file holds no shaper; the sentence says why."""


@dataclass(frozen=True)
class Info:
    """What a shaper is told at every tick."""

    period: float
    """Tick [s]."""
    joints: int
    """Of the arm; `q_ref` has as many entries."""
    limits: Limits
    """Of the reference, for every joint: velocity [rad/s], acceleration [rad/s²], jerk [rad/s³]."""
    payload: Payload
    """Declared: mass [kg], com [m], inertia [kg m²]."""
    robot: str
    """Model of the arm."""
    f_d: Floats
    """Damped frequencies of the lowest modes, as estimated at the last shaped reference [Hz], shape (4,)."""
    zeta: Floats
    """Damping ratios of the same [-], shape (4,)."""


@dataclass(frozen=True)
class Task:
    """A reference to be shaped."""

    description: RobotDescription
    """What the controller knows of the arm."""
    move: Move
    """From where to where; its mass is the one declared."""
    reference: Floats
    """Shape (T, n) [rad]."""


@dataclass(frozen=True)
class Shaped:
    """What a shaper made of a reference."""

    q: Floats
    """Shape (T', n), up to the end and a few ticks more [rad]."""
    delay: float
    """From the reference's end to its own, but no more than it declared [s]."""
    cost: float | None
    """Processor time of a tick, as it happened to take [s]."""


class Stepper(Protocol):
    """A shaper at work on one reference."""

    def step(self, q: Floats) -> Floats:
        """The next sample, shape (n,) [rad]."""

    @property
    def delay(self) -> float | None:
        """By which its last output is spread over the past [s]; None where it does not say."""


class Candidate(ABC):
    """A way to shape."""

    name: str
    """In JSON."""
    label: str
    """For people."""

    @abstractmethod
    def stepper(self, task: Task) -> Stepper | None:
        """At rest at the start; None for what plans the whole motion instead of shaping a reference."""

    def shaped(self, task: Task) -> Shaped:
        """A whole motion, watched for tails.

        Raises:
            ShaperFaultError: The output is no position, does not end, or goes on after its end.
        """
        stepper = self.stepper(task)
        assert stepper is not None
        return run(stepper, task.reference)


@dataclass(frozen=True)
class Named(Candidate):
    """A filter by its name, made as the server makes it."""

    recipe: Recipe
    name: str
    label: str

    def stepper(self, task: Task) -> "Filtering":
        """The filter, reset."""
        return _from_rest(self.recipe.make(task.description, task.move.mass), task)


@dataclass(frozen=True)
class Shaping(Candidate):
    """A baseline that is a fixed shaper."""

    recipe: Recipe
    baseline: Baseline
    name: str
    label: str

    def stepper(self, task: Task) -> "Filtering":
        """The fixed filter, reset; where it is designed for the target, that is known to it."""
        baseline = self.baseline
        assert baseline.shaper is not None
        f_d, zeta = baseline.f_d, baseline.zeta
        if f_d is None or zeta is None:
            estimator = self.recipe.estimator(task.description, task.move.mass, 1)
            there = estimator.estimate(np.array(task.move.target))
            f_d, zeta = float(there[0][0]), float(there[1][0])
        joints = task.description.joints
        return _from_rest(TvistFilter(shaper(baseline.shaper), Fixed([f_d], [zeta]), joints=joints), task)


def _from_rest(tvist: Filter, task: Task) -> "Filtering":
    """A filter at rest where a move starts."""
    tvist.reset(task.move.start)
    return Filtering(tvist.filter, lambda: tvist.delay)


@dataclass(frozen=True)
class Longer(Candidate):
    """A double S that takes as long as another candidate's motion, and knows no model."""

    like: Candidate
    name: str
    label: str

    def stepper(self, task: Task) -> None:  # noqa: ARG002
        """It shapes no reference."""
        return

    def shaped(self, task: Task) -> Shaped:
        """A double S with less jerk."""
        other = self.like.shaped(task)
        ticks = len(task.reference) + round(other.delay / PERIOD)
        start, target = np.array(task.move.start), np.array(task.move.target)
        return Shaped(lengthened(start, target, ticks, PAPER), other.delay, None)


@dataclass(frozen=True)
class FromFile(Candidate):
    """A shaper from a person's own file."""

    path: str
    recipe: Recipe
    """Says where the estimate comes from that it is told."""
    name: str
    label: str

    def stepper(self, task: Task) -> "Foreign":
        """A new one, reset."""
        description, move = task.description, task.move
        estimator = self.recipe.estimator(description, move.mass, MODES)
        info = Info(
            period=PERIOD,
            joints=description.joints,
            limits=PAPER,
            payload=paper_payload(description, move.mass),
            robot=description.robot.model,
            f_d=np.zeros(MODES),
            zeta=np.zeros(MODES),
        )
        try:
            made = load_shaper(Path(self.path))()
        except CandidateError:
            raise
        except Exception as error:
            raise ShaperFaultError(f"raises {_named(error)} when it is made") from error
        return Foreign(made, info, estimator, np.array(move.start), np.array(description.limits.position))


@dataclass(frozen=True)
class Filtering:
    """A filter at work."""

    step: Callable[[Floats], Floats]
    """Sample to shaped sample."""
    declared: Callable[[], float]
    """Its delay now."""

    @property
    def delay(self) -> float:
        """Of the last output [s]."""
        return self.declared()


class Foreign:
    """A shaper that nothing is known of, at work.

    Args:
        made: Has `step`, and may have `reset` and `delay`.
        info: What it is told, but for the modes.
        estimator: Of these.
        start: Where the reference rests, shape (n,) [rad].
        reach: How far each joint turns either way, shape (n,) [rad].

    Raises:
        ShaperFaultError: Its `reset` raises.
    """

    def __init__(self, made: Any, info: Info, estimator: Estimator, start: Floats, reach: Floats) -> None:
        self._made, self._info, self._estimator, self._reach = made, info, estimator, reach
        self._q_star, self._tick = start.copy(), 0
        if hasattr(made, "reset"):
            try:
                made.reset(start.copy())
            except Exception as error:
                raise ShaperFaultError(f"its reset raises {_named(error)}") from error

    @property
    def delay(self) -> float | None:
        """What it declares."""
        try:
            declared = getattr(self._made, "delay", None)
        except Exception as error:
            raise ShaperFaultError(f"raises {_named(error)} when asked for its delay") from error
        return float(declared) if isinstance(declared, int | float | np.floating) else None

    def step(self, q: Floats) -> Floats:
        """One tick.

        Raises:
            ShaperFaultError: It raises, or what it gives is no position.
        """
        f_d, zeta = self._estimator.estimate(self._q_star)
        info = replace(self._info, f_d=f_d.copy(), zeta=zeta.copy())
        where = f"at tick {self._tick}"
        try:
            given = self._made.step(q.copy(), info)
        except Exception as error:
            raise ShaperFaultError(f"raises {_named(error)} {where}") from error
        try:
            q_star = np.array(given, dtype=float)
        except (TypeError, ValueError):
            raise ShaperFaultError(
                f"gives {type(given).__name__} {where}, where {q.size} numbers are wanted"
            ) from None
        if q_star.shape != q.shape:
            raise ShaperFaultError(f"gives shape {q_star.shape} {where}, where {q.shape} is wanted")
        if not np.isfinite(q_star).all():
            raise ShaperFaultError(f"gives {q_star.tolist()} {where}: not every number is finite")
        if (np.abs(q_star) > self._reach).any():
            joint = int(np.argmax(np.abs(q_star) - self._reach))
            raise ShaperFaultError(
                f"gives {q_star[joint]:g} rad for joint {joint + 1} {where}: it turns ±{self._reach[joint]:.4g} rad"
            )
        self._q_star, self._tick = q_star, self._tick + 1
        return q_star.copy()


def run(stepper: Stepper, reference: Floats) -> Shaped:
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


_loaded: dict[Path, Callable[[], Any]] = {}


def load_shaper(path: Path) -> Callable[[], Any]:
    """What makes a new shaper of a file: its class with `step`, or its function `step`.

    The file is run once a process: what it keeps in its module lasts from motion to motion.

    Raises:
        CandidateError: It cannot be read or run, or holds no shaper, or several.
    """
    file = path.resolve()
    if file not in _loaded:
        _loaded[file] = _load(file, path)
    return _loaded[file]


def _load(file: Path, said: Path) -> Callable[[], Any]:
    if not file.is_file():
        raise CandidateError(f"shaper {said}: there is no such file")
    name = f"tvist_shaper_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise CandidateError(f"shaper {said}: must be a Python file, *.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise CandidateError(f"shaper {said}: running it raises {_named(error)}") from error
    classes = [
        value
        for value in vars(module).values()
        if inspect.isclass(value) and value.__module__ == name and callable(getattr(value, "step", None))
    ]
    if len(classes) > 1:
        found = ", ".join(value.__name__ for value in classes)
        raise CandidateError(f"shaper {said}: holds several classes with a method step, {found}: leave one")
    if classes:
        try:
            classes[0]()
        except Exception as error:
            raise CandidateError(
                f"shaper {said}: {classes[0].__name__}() raises {_named(error)}; it is made without arguments"
            ) from error
        return classes[0]
    if inspect.isfunction(getattr(module, "step", None)):
        return lambda: module
    raise CandidateError(
        f"shaper {said}: holds neither a class with a method step(q_ref, info) nor a function step"
    )


def _named(error: Exception) -> str:
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words}" if words else type(error).__name__
