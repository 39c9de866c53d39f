"""Moves with one shaper and the baselines: what `tvist evaluate` measures, and its summary."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tvist_controller.api.line import MotionLimits
from tvist_lab.recordings import Floats
from tvist_lab.study.arms import AS_DESCRIBED
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.held_out import interval, percentiles
from tvist_lab.study.line import PAPER
from tvist_lab.study.measures import OF_PEAKS, WORTH
from tvist_lab.study.method import Method, Waiting
from tvist_lab.study.moves import Move
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import Job, Row
from tvist_plant.description import RobotDescription
from tvist_plant.variants import Variant
from tvist_protocol.calibration import Calibration

WANTED = (*OF_PEAKS, "still_after_unshaped_stop_ms", "quiet_after_unshaped_stop_ms")
"""Measures of each motion."""
MOVES = (
    Shown("move", "place"), Shown("kg", "payload_kg", 2), Shown("unshaped m/s²", "unshaped_peak_m_s2", 3),
    Shown("shaped m/s²", "shaped_peak_m_s2", 3), Shown("less %", "reduction_percent", 1),
    Shown("delay ms", "delay_ms", 0), Shown("still ms", "still_after_ms.shaped", 0),
    Shown("q̈/limit", "peak_acceleration_ratio", 3), Shown("q̇/limit", "peak_velocity_ratio", 3),
)  # fmt: skip
"""Table of the moves one by one."""
WAYS = (
    Shown("", "name"), Shown("less % median", "reduction_percent.median", 1), Shown("p5", "reduction_percent.p5", 1),
    Shown("min", "reduction_percent.min", 1), Shown("than waiting² %", "less_than_waiting_percent.median", 1),
    Shown("p5", "less_than_waiting_percent.p5", 1), Shown("delay ms", "delay_ms.median", 0),
    Shown("still¹ ms", "still_after_unshaped_stop_ms.median", 0), Shown("p90", "still_after_unshaped_stop_ms.p90", 0),
    Shown("q̈/limit", "peak_acceleration_ratio.median", 3), Shown("max", "peak_acceleration_ratio.max", 3),
    Shown("q̇ max", "peak_velocity_ratio.max", 3),
)  # fmt: skip
"""Table of the methods."""

Rows = Sequence[Row]
"""Rows of one move: by the shaper, waiting, and by each baseline."""


def feasible(
    moves: Sequence[Move], description: RobotDescription, limits: MotionLimits = PAPER
) -> list[Move]:
    """Return the moves for which the drives are strong enough."""
    return [move for move in moves if Case(description, move, limits=limits).torque_share <= 1.0]


def jobs(
    description: RobotDescription,
    moves: Sequence[Move],
    seed: int,
    shaper: Method,
    others: Sequence[Method] = (),
    *,
    limits: MotionLimits = PAPER,
    payload_error: float = 0.0,
    arm: Variant = AS_DESCRIBED,
    streams: bool = False,
) -> list[Job]:
    """Return a job for each move: by the shaper, which others of the same duration are compared with, and by these.

    Args:
        description: The arm, and the controller's model of it.
        moves: The moves.
        seed: Seed of gear errors and deviations.
        shaper: The shaper.
        others: What is compared with it, besides waiting.
        limits: Limits of the moves.
        payload_error: Error of the declared mass, relative to the carried one [-].
        arm: What the arm is like, of which the controller knows the description.
        streams: Whether to follow streams from the start of each move instead.
    """
    every, arms = (shaper, Waiting(), *others), (arm,)
    return [
        Job(
            Case(
                description, move, arm_seed(seed, place), arms, limits, payload_error, streams,
                {"payload_kg": move.mass},
            ),
            every,
            WANTED,
        )
        for place, move in enumerate(moves)
    ]  # fmt: skip


def report(judged: Sequence[Rows]) -> dict[str, Any]:
    """Return the part of `tvist evaluate --json` about the moves."""
    others = range(2, len(judged[0])) if judged else range(0)
    names = {place: judged[0][place]["shaper"] for place in (1, *others)} if others else {}
    moves = [_move(rows) for rows in judged]
    left_out = [place for place, move in enumerate(moves, 1) if move["reduction_percent"] is None]
    return {
        "moves": moves,
        "counted": len(moves) - len(left_out),
        "left_out": left_out,
        **_summary([rows[0] for rows in judged]),
        "baselines": {name: _summary([rows[place] for rows in judged]) for place, name in names.items()},
    }


def _move(rows: Rows) -> dict[str, Any]:
    shaped, _, *others = rows
    same = (
        "payload_kg", "unshaped_peak_m_s2", "shaped_peak_m_s2", "reduction_percent", "delay_ms",
        "peak_acceleration_ratio", "peak_velocity_ratio",
    )  # fmt: skip
    found = {name: shaped[name] for name in same}
    found["still_after_ms"] = {
        "unshaped": shaped["unshaped_still_after_ms"],
        "shaped": shaped["shaped_still_after_ms"],
    }
    if others:
        found["baselines"] = {
            row["shaper"]: {
                "peak_m_s2": row["shaped_peak_m_s2"],
                "reduction_percent": row["reduction_percent"],
                "delay_ms": row["delay_ms"],
                "still_after_ms": row["shaped_still_after_ms"],
            }
            for row in others
        }
    return found


def _summary(rows: Rows) -> dict[str, Any]:
    """Summarize one method over all moves; reductions only over moves that count."""

    def of(name: str, among: Rows = rows) -> Floats:
        return np.array([row[name] for row in among if row[name] is not None], dtype=float)

    counted = [row for row in rows if row["reduction_percent"] is not None]
    quiet = [row["shaped_peak_m_s2"] for row in rows if row["reduction_percent"] is None]
    reductions, late = of("reduction_percent"), of("still_after_unshaped_stop_ms")
    return {
        "peak_m_s2": percentiles(of("shaped_peak_m_s2", counted), median=50, p95=95, max=100),
        "reduction_percent": percentiles(reductions, median=50, p5=5, min=0),
        "reduction_percent_interval": {
            name: interval(reductions, share) for name, share in (("median", 50), ("p5", 5))
        },
        "delay_ms": percentiles(of("delay_ms"), median=50, max=100),
        "peak_acceleration_ratio": percentiles(of("peak_acceleration_ratio"), median=50, p90=90, max=100),
        "peak_velocity_ratio": percentiles(of("peak_velocity_ratio"), median=50, p90=90, max=100),
        "less_than_waiting_percent": percentiles(of("less_than_waiting_percent"), median=50, p5=5, min=0),
        "still_after_unshaped_stop_ms": percentiles(late, median=50, p90=90, max=100),
        "quiet_after_unshaped_stop_ms": percentiles(
            of("quiet_after_unshaped_stop_ms"), median=50, p90=90, max=100
        ),
        "never_still": len(rows) - len(late),
        "left_out_largest_peak_m_s2": max(quiet, default=None),
    }


def example(moves: Rows) -> int:
    """Place of the move that is drawn: the middle one by unshaped vibration, of those that count if any do."""
    counted = [place for place, move in enumerate(moves) if move["reduction_percent"] is not None]
    counted = counted or list(range(len(moves)))
    return sorted(counted, key=lambda place: float(moves[place]["unshaped_peak_m_s2"]))[len(counted) // 2]


def notes(
    result: dict[str, Any],
    met: list[str | None],
    known: Calibration | None,
    chosen: list[Move],
    share: float | None,
    wanted: int,
) -> list[str]:
    """Return what a reader of an evaluation has to know.

    Args:
        result: What `tvist evaluate --json` prints.
        met: For moves of a file, which bodies meet on each.
        known: The calibration.
        chosen: The moves that were made.
        share: Share of the drawn moves that were free of collision; None if they are of a file.
        wanted: Number of moves, with those for which the drives are too weak.
    """
    found = []
    if share is not None:
        free = f"{100.0 * share:.0f} % of the drawn moves were free of collisions; the others were replaced"
        found.append("all drawn moves were free of collisions" if share == 1.0 else free)
    if result["left_out"]:
        found.append(
            f"{len(result['left_out'])} of {len(chosen)} moves have an unshaped peak below {WORTH:g} m/s²: the "
            "percentages leave them out"
        )
    found += [
        f"move {place}: a robot would refuse it because {words}; it was evaluated anyway"
        for place, words in enumerate(met, 1)
        if words is not None
    ]
    if known is not None and known.modal is None and result["shaper"] != "none":
        off = sum(
            abs(move.mass - known.payload.mass) > 0.02 * max(known.payload.mass, 1.0) for move in chosen
        )
        if off:
            found.append(
                f"calibration {known.name} was made with {known.payload.mass:g} kg; {off} moves carry something else"
            )
    if result["never_still"]:
        found.append(
            f"{result['never_still']} shaped moves were still above 0.1 m/s² at the end of the simulation"
        )
    if len(chosen) < wanted:
        found.append(f"{wanted - len(chosen)} of {wanted} moves were left out: the drives are too weak")
    return found
