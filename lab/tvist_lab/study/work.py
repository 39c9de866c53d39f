"""The work of a job: make a case by some methods on its arms, and measure each motion as one flat row."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from tvist_controller.api.line import body, paper_payload
from tvist_lab.recordings import Recording
from tvist_lab.runners import TaskError
from tvist_lab.study.case import Case
from tvist_lab.study.line import ControlLine
from tvist_lab.study.measures import OF_PEAKS, ExecutedMotion, measured
from tvist_lab.study.method import Method, Task, WaitingMethod
from tvist_lab.study.shaping import Shaped, ShaperFaultError
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD, SimulatedArm
from tvist_plant.user_file import named

MEASURED, TOO_WEAK, FAILED = "measured", "too weak", "failed"

Row = Mapping[str, Any]  # a row: values by column name


@dataclass(frozen=True)
class Job:
    """A case, and the methods to make it."""

    case: Case
    methods: tuple[Method, ...]
    measures: tuple[str, ...] = OF_PEAKS
    as_served: bool = True  # see `Task.as_served`

    @property
    def motions(self) -> int:
        """Number of motions."""
        return len(self.methods) * len(self.case.arms)

    def head(self, method: str, arm: str) -> dict[str, Any]:
        """Return the cells of a row that are known in advance."""
        return {**self.case.axes, "shaper": method, "arm": arm}


class Bench:
    """The arms and the control line of a job."""

    def __init__(self, job: Job) -> None:
        self.job, case = job, job.case
        reference = case.reference()
        self.task = Task(case.description, case.declared, reference, case.limits, job.as_served, case.stream)
        """Task of the first method."""
        # The friction in the robot's calibration is fed forward for every method, shaped or not, unless the
        # method sets another friction, `Shaped.law`.
        recipes = (getattr(method, "recipe", None) for method in job.methods)
        law = next((recipe.friction(case.description) for recipe in recipes if recipe is not None), None)
        self._line = ControlLine(
            case.description, np.array(case.move.start), self._body(case.declared.mass), law
        )
        self._plain: dict[str, ExecutedMotion] = {}
        self.ticks: int | None = None
        """Duration of the first motion, for methods of equal duration; None before it is measured."""

    @cached_property
    def _arms(self) -> dict[str, SimulatedArm]:
        """The arms by name, each reset for every motion."""
        case, carried = self.job.case, self._body(self.job.case.move.mass)
        return {arm.name: arm.make(case.description, carried, case.seed) for arm in case.arms}

    def _body(self, mass: float) -> Payload:
        return body(paper_payload(self.job.case.description, mass))

    def make(self, method: Method) -> Iterator[tuple[str, ExecutedMotion]]:
        """Yield each arm's name and motion."""
        if isinstance(method, WaitingMethod):
            yield from ((arm.name, self.unshaped(arm.name)) for arm in self.job.case.arms)
            return
        shaped = method.shaped(replace(self.task, ticks=self.ticks))
        follow, first = self._following(shaped), None
        for arm in self.job.case.arms:
            unshaped = partial(self.unshaped, arm.name)
            motion = ExecutedMotion(self.job.case, shaped, follow(arm.name), unshaped, first)
            first = first or motion
            yield arm.name, motion

    def unshaped(self, arm: str) -> ExecutedMotion:
        """Return the unshaped motion of an arm, which is simulated once."""
        if arm not in self._plain:
            shaped = Shaped(self.task.reference)
            recording = self._following(shaped)(arm)
            self._plain[arm] = ExecutedMotion(self.job.case, shaped, recording, partial(self.unshaped, arm))
        return self._plain[arm]

    def _following(self, shaped: Shaped) -> Callable[[str], Recording]:
        drives = shaped.delay, shaped.elastic, shaped.law
        following = self._line.follow(self.task.reference, shaped.q, *drives)
        return lambda arm: following.simulate(self._arms[arm], self.job.case.seed)


def measure(job: Job) -> tuple[Row, ...]:
    """Make a case by every method on every arm; methods after the first are compared with it."""
    bench = Bench(job)
    return tuple(row for method in job.methods for row in _rows(bench, method))


def measure_each(job: Job) -> tuple[Row, ...]:
    """Make a case by every method; if a method fails, only its own rows have no results."""
    try:
        share = 0.0 if job.case.stream or not job.as_served else job.case.torque_share
        if share > 1.0:
            return failed(job, TOO_WEAK, f"the move needs {100.0 * share:.0f} % of a drive's torque")
        bench = Bench(job)
        if job.as_served:
            for arm in job.case.arms:  # if the unshaped motion fails on an arm, no method is to blame
                _ = bench.unshaped(arm.name).peak
    except Exception as error:  # noqa: BLE001  it costs these rows alone
        return failed(job, FAILED, why(error))
    found: list[Row] = []
    for method in job.methods:
        try:
            found += _rows(bench, method)
        except ShaperFaultError as fault:
            found += failed(job, FAILED, f"the shaper {fault}", [method])
        except Exception as error:  # noqa: BLE001  it costs these rows alone
            found += failed(job, FAILED, why(error), [method])
    return tuple(found)


def _rows(bench: Bench, method: Method) -> list[Row]:
    job = bench.job
    found: list[Row] = []
    for arm, motion in bench.make(method):
        found.append(job.head(method.name, arm) | {"status": MEASURED, **measured(motion, job.measures)})
        bench.ticks = bench.ticks or round(motion.duration / PERIOD)
    return found


def record(job: Job) -> tuple[Recording, Recording]:
    """Record a case on its first arm, unshaped and by the job's first method."""
    ((_, motion), *_) = Bench(job).make(job.methods[0])
    return motion.unshaped.recording, motion.recording


def failed(job: Job, status: str, error: str, methods: Sequence[Method] = ()) -> tuple[Row, ...]:
    """Return the rows of a job without measurements, of all methods or some."""
    return tuple(
        job.head(method.name, arm.name) | {"status": status, "error": error}
        for method in methods or job.methods
        for arm in job.case.arms
    )


def why(error: Exception) -> str:
    """Return an error as one line."""
    return str(error) if isinstance(error, TaskError) else named(error)
