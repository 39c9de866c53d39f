"""ShaperBench: all shapers on ten arms, with the same random moves, and payloads other than declared."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from tvist_controller.api import body, paper_payload
from tvist_lab.evaluation.arms import ARMS
from tvist_lab.evaluation.candidates import Candidate, Task
from tvist_lab.evaluation.causality import check_causal
from tvist_lab.evaluation.line import PAPER, ControlLine, point_to_point
from tvist_lab.evaluation.moves import Move, draw_moves
from tvist_lab.evaluation.sound import ShaperFaultError
from tvist_lab.metrics import (
    NotMeasurableError,
    best_tool_acceleration,
    envelope,
    in_motion_rms,
    motions,
    still_after,
)
from tvist_lab.metrics.common_clock import Kinematics
from tvist_lab.recordings import Floats, Recording
from tvist_lab.runners import Processes, Runner, in_order
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model
from tvist_plant.plant import PERIOD

PAYLOAD_ERRORS = (0.0, 0.1, -0.1)
"""Errors of the declared mass [-]."""


@dataclass(frozen=True)
class BenchJob:
    """A move with one candidate and one payload error, on all arms."""

    description: RobotDescription
    candidate: Candidate
    move: Move
    """The move, with the carried mass."""
    error: float
    """Error of the declared mass [-]."""
    seed: int
    """Seed of gear errors and scatter."""
    arms: tuple[int, ...]
    """Indices of the arms."""


@dataclass(frozen=True)
class Score:
    """Result of one move on one arm."""

    arm: int
    error: float
    still: float
    """Time until still, from the stop of the unshaped reference [s]; ∞ if not still at the end of the recording."""
    residual: float
    """Largest envelope of α within 3 to 60 Hz after that stop plus the shaper's delay [m/s²]."""
    in_motion: float
    """rms of α relative to the rigid arm [m/s²]."""


@dataclass(frozen=True)
class Scores:
    """Result of a job."""

    scores: tuple[Score, ...]
    delay: float
    """Delay of what the drives get [s]."""
    acceleration: float
    """Largest acceleration relative to the limit of the reference [-]."""
    velocity: float
    """Largest velocity relative to the limit of the reference [-]."""
    cost: float | None
    """Processor time of a tick [s]."""
    fault: str | None = None
    """Why there are no scores; None if there are."""


def inspect(candidate: Candidate, description: RobotDescription, moves: Sequence[Move]) -> str | None:
    """Return why a candidate cannot be ranked, determined without any motion; None if no reason was found."""
    for move in moves[:2]:
        try:
            check_causal(candidate, _task(description, move))
        except ShaperFaultError as fault:
            return str(fault)
    return None


def jobs(
    description: RobotDescription,
    candidates: Sequence[Candidate],
    moves: Sequence[Move],
    seed: int,
    *,
    quick: bool,
) -> list[BenchJob]:
    """Return all jobs: candidate by move by payload error; in the quick version, one error in turn for each move."""
    arms = tuple(range(len(ARMS)))
    errors = [
        (PAYLOAD_ERRORS[number % len(PAYLOAD_ERRORS)],) if quick else PAYLOAD_ERRORS
        for number in range(len(moves))
    ]
    return [
        BenchJob(description, candidate, move, error, seed + number, arms)
        for candidate in candidates
        for number, move in enumerate(moves)
        for error in errors[number]
    ]


def play(jobs: Sequence[BenchJob], runner: Runner | None = None) -> Iterator[Scores]:
    """Do all jobs in order, by default on all cores of this machine."""
    return in_order(runner or Processes(few=2, chunk=1), judge, jobs)


def judge(job: BenchJob) -> Scores:
    """Shape once, and let every arm follow the result."""
    description, move = job.description, job.move
    declared = move.mass * (1.0 + job.error)
    task = _task(description, replace(move, mass=declared))
    start, carried = np.array(move.start), body(paper_payload(description, move.mass))
    believed = body(paper_payload(description, declared))
    try:
        shaped = job.candidate.shaped(task)
    except ShaperFaultError as fault:
        return Scores((), 0.0, 0.0, 0.0, None, str(fault))
    elastic = job.candidate.elastic(task)
    following = ControlLine(description, start, believed).follow(
        task.reference, shaped.q, shaped.delay, elastic
    )
    scores = []
    for number in job.arms:
        arm = ARMS[number].make(description, carried, job.seed)
        scores.append(_score(number, job, following.simulate(arm, job.seed)))
    qd, qdd = np.diff(shaped.q, axis=0) / PERIOD, np.diff(shaped.q, 2, axis=0) / PERIOD**2
    return Scores(
        tuple(scores),
        shaped.delay + (0.0 if elastic is None else elastic.delay),
        float(np.abs(qdd).max()) / PAPER.acceleration,
        float(np.abs(qd).max()) / PAPER.velocity,
        shaped.cost,
    )


def _score(number: int, job: BenchJob, recording: Recording) -> Score:
    motion = motions(recording)[0]
    try:
        still = still_after(recording, motion) - motion.duration(recording)
    except NotMeasurableError:
        still = math.inf
    # The published target is one tick late.
    declared = recording["shaper_delay"][motion.reference_stop]
    after = motion.reference_stop + 1 + math.ceil(declared / recording.period - 1e-6)
    ringing = envelope(best_tool_acceleration(recording)[after + 1 :], recording.period)
    return Score(
        arm=number,
        error=job.error,
        still=still,
        residual=float(ringing.max()),
        in_motion=in_motion_rms(recording, motion, kinematics(job.description)),
    )


def _task(description: RobotDescription, move: Move) -> Task:
    return Task(description, move, point_to_point(np.array(move.start), np.array(move.target)))


def kinematics(description: RobotDescription) -> Kinematics:
    """Return the kinematics of the rigid arm's flange."""
    model = rigid_model(description, Payload())
    data, flange = model.createData(), model.getFrameId(FLANGE)

    def at(q: Floats) -> tuple[Floats, Floats]:
        pin.forwardKinematics(model, data, q)
        placement = pin.updateFramePlacement(model, data, flange)
        return placement.translation.copy(), placement.rotation.copy()

    return at


def draw(description: RobotDescription, count: int, seed: int) -> list[Move]:
    """Return the moves of the benchmark, each with its own payload up to the arm's rating."""
    return draw_moves(description, count, seed, (0.0, description.limits.payload)).moves
