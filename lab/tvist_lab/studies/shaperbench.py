"""ShaperBench: all methods on fifteen arms with the same random moves and wrong payloads, and round corners."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tvist_lab.recordings import Floats
from tvist_lab.runners import TaskError
from tvist_lab.study.arms import ARMS
from tvist_lab.study.case import Case
from tvist_lab.study.engine import made
from tvist_lab.study.line import round_a_corner
from tvist_lab.study.method import Method, Stepping, Task
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.shaping import ShaperFaultError
from tvist_lab.study.work import FAILED, Job, Row, measure_each
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_plant.variants import HEAVIER, Variant, rubbed

STICKS = "ur5e_stiction"
"""The robot file of the arms whose motors stick; with its own calibration it is all that their controller knows."""
STICKING = (
    Variant("stiction", "motors that stick near standstill, as the controller knows"),
    Variant("more_stiction", "motors that stick more than the controller knows", partial(rubbed, HEAVIER)),
)
"""These arms."""
PAYLOAD_ERRORS = (0.0, 0.1, -0.1)
"""Errors of the declared mass [-]."""
WANTED = (
    "time_until_still_ms", "residual_m_s2", "in_motion_m_s2", "declared_delay_ms", "reference_acceleration_ratio",
    "reference_velocity_ratio", "cost_us",
)  # fmt: skip
"""Measures of each motion."""
PLACES = (0.15, 0.5, 0.8)
"""Positions after which the references differ, as shares of the motion [-]."""
ELSEWHERE = 1.0
"""Acceleration with which the other reference deviates [rad/s²]."""
CORNERS = 5
"""Number of curved paths."""
TWICE = "gives another output when the same reference is run again: it keeps something, or draws by chance"


def draw(description: RobotDescription, count: int, seed: int) -> list[Move]:
    """Return the moves of the benchmark, each with its own payload up to the arm's rating."""
    return draw_moves(description, count, seed, (0.0, description.limits.payload)).moves


def inspect(method: Method, description: RobotDescription, moves: Sequence[Move]) -> str | None:
    """Return why a method cannot be ranked, determined without any motion; None if no reason was found."""
    for move in moves[:2]:
        try:
            check_causal(method, Task(description, move, Case(description, move).point_to_point()))
        except ShaperFaultError as fault:
            return str(fault)
    return None


def check_causal(method: Method, task: Task) -> None:
    """Run a shaper on a reference, on others with the same beginning, and again on the first one.

    A shaper that remembers a reference, or reads it where it is stored, gives different outputs for a different
    future. A method that is given the target of a move in advance gets the same target with every reference: it may
    know where the move was to end, but no more of the way there than other methods.

    Raises:
        ShaperFaultError: It does so, or the same reference gives a different output the second time.
    """
    if not isinstance(method, Stepping):
        return  # it plans the motion, whose end it may know
    first = _outputs(method, task)
    for place in PLACES:
        tick = int(place * len(task.reference))
        for sign in (1.0, -1.0):
            other = _outputs(method, _elsewhere(method, task, tick, sign))
            apart = np.flatnonzero((first[: tick + 1] != other[: tick + 1]).any(axis=1))
            if apart.size:
                raise ShaperFaultError(
                    f"peeks at the future: references that are equal up to tick {tick} give other outputs from tick "
                    f"{apart[0]} on"
                )
    again = _outputs(method, task)
    if not np.array_equal(first, again):
        raise ShaperFaultError(TWICE)


def _outputs(method: Stepping, task: Task) -> Floats:
    stepper = method.stepper(task)
    return np.array([stepper.step(sample) for sample in task.reference])


def _elsewhere(method: Method, task: Task, tick: int, sign: float) -> Task:
    """Return the task with a reference that deviates from the first one on a parabola after a tick."""
    reference = task.reference.copy()
    late = PERIOD * np.arange(1, len(reference) - tick)
    reference[tick + 1 :] += sign * 0.5 * ELSEWHERE * late[:, None] ** 2
    told = task.move.target if method.told_target else tuple(reference[-1].tolist())
    return replace(task, reference=reference, move=replace(task.move, target=told))


def jobs(
    description: RobotDescription,
    methods: Sequence[Method],
    moves: Sequence[Move],
    seed: int,
    *,
    quick: bool,
    arms: Sequence[Variant] = ARMS,
) -> list[Job]:
    """Return all jobs: methods by move by payload error; in the quick version, one error in turn for each move.

    The methods of a job make their motions on the same arms. What a calibration tells of friction is fed forward to
    all of a job, so that methods without one have jobs of their own.
    """
    known, others = ([one for one in methods if hasattr(one, "recipe") is has] for has in (True, False))
    return [
        Job(
            Case(
                description,
                move,
                seed + number,
                tuple(arms),
                payload_error=error,
                axes={"move": number, "payload_error": error},
            ),
            tuple(together),
            WANTED,
            as_served=False,
        )
        for number, move in enumerate(moves)
        for error in ((PAYLOAD_ERRORS[number % len(PAYLOAD_ERRORS)],) if quick else PAYLOAD_ERRORS)
        for together in (known, others)
        if together
    ]


def play(jobs: Sequence[Job]) -> Iterator[tuple[Row, ...]]:
    """Do all jobs in order, on all cores of this machine; a method that fails has rows that say why.

    Raises:
        TaskError: Something else than a method failed.
    """
    for rows in made(jobs, measure_each):
        for row in rows:
            if row["status"] == FAILED and fault_of(row) is None:
                raise TaskError(row["error"])
        yield rows


def fault_of(row: Row) -> str | None:
    """Return what a method did wrong; None if it did not."""
    before, found, fault = str(row.get("error", "")).partition("the shaper ")
    return fault if found and not before else None


@dataclass(frozen=True)
class Bend:
    """A curved path for one method."""

    description: RobotDescription
    method: Method
    corner: tuple[Move, Move]
    """Two moves; the second starts where the first ends."""


def bends(description: RobotDescription, methods: Sequence[Method], moves: Sequence[Move]) -> list[Bend]:
    """Pair each method that shapes references with a few moves, each continued to the start of the next one."""
    paths = [
        (first, replace(second, start=first.target, target=second.start, mass=first.mass))
        for first, second in zip(moves[:CORNERS], [*moves[1:], moves[0]], strict=False)
    ]
    return [Bend(description, method, path) for method in methods if method.shapes for path in paths]


def bend(job: Bend) -> float | None:
    """Return a method's deviation from a curved path [rad]; None if it cannot be ranked."""
    first, second = job.corner
    start, corner, target = (np.array(q) for q in (first.start, first.target, second.target))
    reference = round_a_corner(start, corner, target)
    whole = Move(first.start, second.target, first.mass)
    try:
        return path_error(reference, job.method.shaped(Task(job.description, whole, reference)).q)
    except ShaperFaultError:
        return None


def path_error(path: Floats, q: Floats) -> float:
    """Largest distance of points from a path in joint space, regardless of time [rad].

    Args:
        path: Vertices of the path, shape (T, n) [rad].
        q: Points, shape (T', n) [rad].
    """
    start, way = path[:-1], np.diff(path, axis=0)
    moving = np.linalg.norm(way, axis=1) > 0.0
    start, way = start[moving], way[moving]
    square = np.sum(way**2, axis=1)
    largest = 0.0
    for point in q[::4]:
        share = np.clip(np.sum((point - start) * way, axis=1) / square, 0.0, 1.0)
        nearest = np.min(np.sum((start + share[:, None] * way - point) ** 2, axis=1))
        largest = max(largest, float(nearest))
    return math.sqrt(largest)
