"""ShaperBench: all methods on ten arms, with the same random moves, and payloads other than declared."""

from collections.abc import Iterator, Sequence

from tvist_lab.runners import Runner, TaskError
from tvist_lab.study.arms import ARMS
from tvist_lab.study.case import Case
from tvist_lab.study.causality import check_causal
from tvist_lab.study.engine import made
from tvist_lab.study.method import Method, Task
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.shaping import ShaperFaultError
from tvist_lab.study.work import FAILED, Job, Row, measure_each
from tvist_plant.description import RobotDescription

CALIBRATION = "ur5e_modal"
"""Calibration of the bench's arm, unless another one is named."""
PAYLOAD_ERRORS = (0.0, 0.1, -0.1)
"""Errors of the declared mass [-]."""
WANTED = (
    "time_until_still_ms", "residual_m_s2", "in_motion_m_s2", "declared_delay_ms", "reference_acceleration_ratio",
    "reference_velocity_ratio", "cost_us",
)  # fmt: skip
"""Measures of each motion."""


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


def jobs(
    description: RobotDescription,
    methods: Sequence[Method],
    moves: Sequence[Move],
    seed: int,
    *,
    quick: bool,
) -> list[Job]:
    """Return all jobs: method by move by payload error; in the quick version, one error in turn for each move."""
    return [
        Job(
            Case(
                description,
                move,
                seed + number,
                ARMS,
                payload_error=error,
                axes={"move": number, "payload_error": error},
            ),
            (method,),
            WANTED,
            as_served=False,
        )
        for method in methods
        for number, move in enumerate(moves)
        for error in ((PAYLOAD_ERRORS[number % len(PAYLOAD_ERRORS)],) if quick else PAYLOAD_ERRORS)
    ]


def play(jobs: Sequence[Job], runner: Runner | None = None) -> Iterator[tuple[Row, ...]]:
    """Do all jobs in order, by default on all cores of this machine; a method that fails has rows that say why.

    Raises:
        TaskError: Something else than a method failed.
    """
    for rows in made(jobs, runner, measure_each):
        for row in rows:
            if row["status"] == FAILED and fault_of(row) is None:
                raise TaskError(row["error"])
        yield rows


def fault_of(row: Row) -> str | None:
    """Return what a method did wrong; None if it did not."""
    before, found, fault = str(row.get("error", "")).partition("the shaper ")
    return fault if found and not before else None
