"""What a robot that learns its motions leaves of their vibration, repetition by repetition."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvist_controller.api.line import Driven, DrivenLine, body, paper_payload, respond
from tvist_controller.api.robot import AFTER, Beliefs, MotionRecord, MotionStudent, Repetition, added, heights
from tvist_lab.metrics.common_clock import AFTER_STOP
from tvist_lab.recordings import Floats
from tvist_lab.runners import in_order
from tvist_lab.study.line import RESTING, Unchanged, point_to_point
from tvist_lab.study.measures import WORTH
from tvist_lab.study.method import Named, Task
from tvist_lab.study.moves import Move
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.tables import Shown
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Placeable
from tvist_plant.variants import Variant
from tvist_protocol.calibration import Calibration
from tvist_protocol.lessons import MotionLesson

PLANTS = ("stribeck", "springs-30", "springs+30", "torsion", "base", "combined")
"""The plants unless others are named."""
LATER = round(AFTER_STOP / PERIOD)
"""Ticks after the stop from which on vibration counts."""
WORSE = 0.01
"""What the last repetition may leave more than the first one before it counts as worse: noise [m/s²]."""


@dataclass(frozen=True)
class LearningJob:
    """A move that is made again and again by one plant; it can be sent to another process."""

    description: RobotDescription
    calibration: Calibration
    shaper: str
    plant: Variant
    move: Move
    seed: int
    """Seed of gear errors, deviations and noise."""
    repetitions: int
    """Number of times that it is repeated after the first one."""


@dataclass(frozen=True)
class Learnt:
    """What became of a move."""

    plant: str
    unshaped: float
    """Peak of the unshaped move [m/s²]."""
    peaks: tuple[float, ...]
    """Peak of each repetition [m/s²]."""


def learn(job: LearningJob) -> Learnt:
    """Make a move on the control line, and let a student study each repetition as a served robot's does."""
    arm_payload = paper_payload(job.description, job.move.mass)
    start, target = np.array(job.move.start), np.array(job.move.target)
    reference = point_to_point(start, target)
    line = DrivenLine(job.description, Unchanged(len(start)), start, body(arm_payload))
    plant = job.plant.make(job.description, body(arm_payload), job.seed)
    peaks: list[float] = []
    lesson: MotionLesson | None = None
    commands, rest, stop = _driven(line, job, job.shaper, reference)
    student, noise = MotionStudent(job.description), np.random.default_rng(job.seed)
    beliefs = Beliefs(arm_payload, job.calibration, job.shaper)
    first = _record(commands, rest, stop, beliefs)
    for _ in range(job.repetitions + 1):
        played = commands
        if lesson is not None and lesson.bumps:
            played = commands + added(heights(lesson.bumps), first, lesson.begins, job.description)
        felt = _felt(plant, rest, played, job.seed)
        peaks.append(_peak(felt, stop))
        heard = felt + job.description.sensors.accelerometer_noise * noise.standard_normal(felt.shape)
        repetition = Repetition("0" * 16, lesson if lesson is not None and lesson.bumps else None)
        found = student.study(_record(played, rest, stop, beliefs, heard, repetition))
        lesson = found if found is not None else lesson
    plain, at, ends = _driven(line, job, "none", reference)
    return Learnt(job.plant.name, _peak(_felt(plant, at, plain, job.seed), ends), tuple(peaks))


def learnt(jobs: Sequence[LearningJob]) -> Iterator[Learnt]:
    """Do all jobs; yield what became of each in order."""
    return in_order(learn, jobs, few=2)


def report(done: Sequence[Learnt]) -> list[dict[str, Any]]:
    """Return the figures of each plant: of each repetition, the reduction's median and 5th percentile [%]."""
    found = []
    for plant in dict.fromkeys(one.plant for one in done):
        these = [one for one in done if one.plant == plant and one.unshaped >= WORTH]
        if not these:
            found.append({"plant": plant, "moves": 0, "worse": 0, "repetitions": []})
            continue
        less = np.array([[100.0 * (1.0 - peak / one.unshaped) for peak in one.peaks] for one in these])
        rows = [{"median": float(np.median(row)), "p5": float(np.percentile(row, 5))} for row in less.T]
        worse = sum(one.peaks[-1] > one.peaks[0] + WORSE for one in these)
        found.append({"plant": plant, "moves": len(these), "worse": worse, "repetitions": rows})
    return found


def columns(repetitions: int) -> list[Shown]:
    """Return the columns of the table."""

    def cell(number: int) -> Shown:
        def text(entry: Mapping[str, Any]) -> str | None:
            rows = entry["repetitions"]
            return f"{rows[number]['median']:.1f} / {rows[number]['p5']:.1f}" if rows else None

        return Shown("first" if number == 0 else f"{number}", text)

    ends = [Shown("moves", "moves", 0), Shown("worse", "worse", 0)]
    return [Shown("plant", "plant"), *map(cell, range(repetitions + 1)), *ends]


def _driven(
    line: DrivenLine, job: LearningJob, shaper: str, reference: Floats
) -> tuple[Floats, DriveCommand, int]:
    """Return the commands of a shaped reference, the command before them, and when they rest."""
    recipe = Recipe(shaper, job.calibration)
    task = Task(job.description, job.move, reference, as_served=True)
    shaped = Named(recipe, shaper).shaped(task)
    driven = line.drive(
        np.array(job.move.start), shaped.q, RESTING + len(shaped.q) + AFTER + 20, RESTING, shaped.elastic
    )
    moving = np.flatnonzero(np.abs(np.diff(driven.targets[:, 0], axis=0)).max(axis=1) > 1e-7)
    stop = int(moving[-1]) + 2 + round(driven.delay / PERIOD)
    return driven.commands[: stop + AFTER], driven.rest, stop


def _felt(plant: Placeable, rest: DriveCommand, commands: Floats, seed: int) -> Floats:
    return respond(plant, Driven(rest, commands, commands, 0.0), seed).specific_force


def _peak(felt: Floats, stop: int) -> float:
    after = felt[stop + LATER :] - felt[-1]
    return float(np.sqrt((after**2).sum(axis=1)).max())


def _record(
    commands: Floats,
    rest: DriveCommand,
    stop: int,
    beliefs: Beliefs,
    heard: Floats | None = None,
    repetition: Repetition | None = None,
) -> MotionRecord:
    nothing = np.zeros((len(commands), 3))
    return MotionRecord(
        rest=rest, commands=commands, q=commands[:, 0], moments=commands[:, 2],
        accelerometer=nothing if heard is None else heard, stop=stop, whole=True, beliefs=beliefs,
        repetition=repetition,
    )  # fmt: skip
