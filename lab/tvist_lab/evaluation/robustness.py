"""Reduction of vibration by each candidate on arms that are stiffer or softer, or carry more or less, than declared."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from dataclasses import replace as changed
from typing import Any

import numpy as np
from msgspec.structs import replace

from tvist_controller.api import body, paper_payload
from tvist_lab.evaluation.candidates import Candidate, Task
from tvist_lab.evaluation.evaluate import QUIET, WORTH, measured
from tvist_lab.evaluation.line import ControlLine, point_to_point
from tvist_lab.evaluation.moves import Move
from tvist_lab.runners import Processes, in_order
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm

ERRORS: dict[str, tuple[float, ...]] = {
    "stiffness": (0.0, 0.05, -0.05, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3),
    "payload": (0.0, 0.1, -0.1, 0.2, -0.2),
}
"""Relative errors [-]: by which all springs of the arm are stiffer than calibrated, and by which the declared mass
exceeds the carried one.
"""
PERCENTILES = {"median": 50.0, "p5": 5.0}
"""Percentiles over moves."""


@dataclass(frozen=True)
class ErrorJob:
    """A move with one error, by every candidate."""

    description: RobotDescription
    candidates: tuple[Candidate, ...]
    move: Move
    """The move, with the carried mass."""
    kind: str
    """Kind of the error, a key of `ERRORS`."""
    error: float
    """Relative error [-]."""
    seed: int
    """Seed of gear errors."""


@dataclass(frozen=True)
class Reduced:
    """One move by one candidate."""

    delay: float
    """Extra duration of the reference, as the drives get it [ms]."""
    less: float
    """Reduction of the peak compared with the unshaped move [%]."""
    beyond: float | None
    """The same compared with waiting until the same moment [%]; None if waiting alone is enough."""


@dataclass(frozen=True)
class Robustness:
    """Result of a job."""

    unshaped: float
    """Peak of the unshaped move [m/s²]."""
    reduced: dict[str, Reduced]
    """Result of each candidate, by name."""


def error_jobs(
    description: RobotDescription, candidates: Sequence[Candidate], moves: Sequence[Move], seed: int
) -> list[ErrorJob]:
    """Return all jobs: kind of error by size by move."""
    return [
        ErrorJob(description, tuple(candidates), move, kind, error, seed + number)
        for kind, errors in ERRORS.items()
        for error in errors
        for number, move in enumerate(moves)
    ]


def make_all(jobs: Sequence[ErrorJob]) -> Iterator[Robustness]:
    """Do all jobs in order, on all cores."""
    return in_order(Processes(few=2, chunk=1), make, jobs)


def make(job: ErrorJob) -> Robustness:
    """Make a move unshaped and by every candidate, on the same arm."""
    description, move = job.description, job.move
    start, target = np.array(move.start), np.array(move.target)
    carried = body(paper_payload(description, move.mass))
    plant = description
    if job.kind == "stiffness":
        plant = stiffer(description, 1.0 + job.error)
    else:
        move = changed(move, mass=move.mass * (1.0 + job.error))
    believed = body(paper_payload(description, move.mass))
    line, arm = ControlLine(description, start, believed), FlexibleArm(plant, carried)
    reference = point_to_point(start, target)
    task = Task(description, move, reference)
    plain = line.follow(reference, reference).simulate(arm, job.seed)
    unshaped = measured(plain)
    reduced = {}
    for candidate in job.candidates:
        shaped, elastic = candidate.shaped(task), candidate.elastic(task)
        following = line.follow(reference, shaped.q, shaped.delay, elastic)
        made = measured(following.simulate(arm, job.seed), plain)
        reduced[candidate.name] = Reduced(
            1e3 * (made.duration - unshaped.duration),
            100.0 * (1.0 - made.peak / unshaped.peak),
            100.0 * (1.0 - made.peak / made.waited) if made.waited >= QUIET else None,
        )
    return Robustness(unshaped.peak, reduced)


def stiffer(description: RobotDescription, factor: float) -> RobotDescription:
    """Return an arm all of whose springs are stiffer by a factor; their damping stays the same."""
    drives, links = description.drives, description.link_flexibility
    return replace(
        description,
        drives=replace(drives, gear_stiffness=tuple(factor * value for value in drives.gear_stiffness)),
        link_flexibility=replace(links, stiffness=tuple(factor * value for value in links.stiffness)),
    )


def robustness_report(
    candidates: Sequence[Candidate], jobs: Sequence[ErrorJob], done: Sequence[Robustness]
) -> list[dict[str, Any]]:
    """Return one row for each candidate, ordered by delay; moves without vibration do not count."""
    counted = [(job, one) for job, one in zip(jobs, done, strict=True) if one.unshaped >= WORTH]
    rows = [
        {
            "name": candidate.name,
            "label": candidate.label,
            "told_target": candidate.told_target,
            "delay_ms": _median([one.reduced[candidate.name].delay for one in done]),
            **{
                kind: {
                    f"{100.0 * error:+.0f} %": _reductions(
                        [
                            one.reduced[candidate.name]
                            for job, one in counted
                            if (job.kind, job.error) == (kind, error)
                        ]
                    )
                    for error in errors
                }
                for kind, errors in ERRORS.items()
            },
        }
        for candidate in candidates
    ]
    return sorted(rows, key=lambda row: (row["delay_ms"], row["name"]))


def _reductions(reduced: Sequence[Reduced]) -> dict[str, Any]:
    beyond = [one.beyond for one in reduced if one.beyond is not None]
    return {
        "moves": len(reduced),
        "reduction_percent": _percentiles([one.less for one in reduced]),
        "beyond_waiting_percent": _percentiles(beyond),
    }


def _percentiles(values: Sequence[float]) -> dict[str, float | None]:
    return {
        name: float(np.percentile(values, share)) if values else None for name, share in PERCENTILES.items()
    }


def _median(values: Sequence[float]) -> float:
    return round(float(np.median(values)), 6)
