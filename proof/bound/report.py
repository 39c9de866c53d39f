"""The bound of each move beside what each shaper takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proof.bound.least_time import MODES, bound
from proof.bound.with_lead import bound_with_lead
from tvist_controller.api.line import body, load_calibration, paper_payload
from tvist_lab.runners import in_order
from tvist_lab.study.case import Case
from tvist_lab.study.line import PAPER
from tvist_lab.study.menus import names
from tvist_lab.study.method import Named
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.work import Job, Row, measure
from tvist_plant.description import RobotDescription, load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.calibration import Calibration

ROBOT, CALIBRATION = "ur5e", "ur5e_modal"
"""The arm, and its calibration."""
PAPERS = (("Q1", "Q2"), ("Q1", "Q3"), ("Q3", "Q1"))
"""The paper's moves, which come before the random ones."""
SHAPERS = names("bound")
"""Shapers that are compared unless others are named."""
SHARE, MORE = 1.15, 4.0
"""A shaper is near the bound if it takes at most this share of it, and this much more [ms]."""
SUMMARY = ("shaper", "delay ms", "less bound ms", "near %", "less %", "p5", "min", "q̈/limit", "q̇/limit")


@dataclass(frozen=True)
class BoundJob:
    """A move to be judged with some shapers."""

    name: str
    """Name of the move."""
    description: RobotDescription
    """The arm, without disturbances."""
    calibration: Calibration
    """Calibration of the shapers."""
    shapers: tuple[str, ...]
    """Names of the shapers."""
    move: Move


@dataclass(frozen=True)
class Bounded:
    """A move with its bound."""

    name: str
    move: Move
    bound: float
    """The bound without feed-forward [ms]."""
    with_lead: float
    """That with feed-forward of the elasticity [ms]."""
    judged: dict[str, Row]
    """Row of each shaper."""


def compare(random: int, seed: int, shapers: Sequence[str] = SHAPERS) -> list[Bounded]:
    """Bound the paper's moves and random ones of an arm without friction, gear errors and noise.

    Args:
        random: Number of random moves, each with a payload of its own up to the arm's rating.
        seed: Seed of these.
        shapers: Names of the shapers that make each move.
    """
    arm, known = load(ROBOT).disturbed_by(()), load_calibration(CALIBRATION)
    moves = [
        (f"{start}-{target}", Move(tuple(arm.poses[start]), tuple(arm.poses[target]), arm.payload.mass))
        for start, target in PAPERS
    ]
    if random:
        drawn = draw_moves(arm, random, seed, (0.0, arm.limits.payload)).moves
        moves += [(str(number), move) for number, move in enumerate(drawn, 1)]
    jobs = [BoundJob(name, arm, known, tuple(shapers), move) for name, move in moves]
    return list(in_order(bounded, jobs, few=2))


def bounded(job: BoundJob) -> Bounded:
    """Compute the bound of a move, and make the move with each shaper."""
    start, target = np.array(job.move.start), np.array(job.move.target)
    arm = FlexibleArm(job.description, body(paper_payload(job.description, job.move.mass)))
    modes = arm.modes(target)
    least = bound(start, target, PAPER, modes.f_d[:MODES], modes.zeta[:MODES])
    lead = bound_with_lead(job.description, job.move, PAPER)
    methods = tuple(Named(Recipe(name, job.calibration), name) for name in job.shapers)
    rows = measure(Job(Case(job.description, job.move), methods))
    judged = {row["shaper"]: row for row in rows}
    return Bounded(job.name, job.move, round(1e3 * least, 6), round(1e3 * lead, 6), judged)


def report(found: Sequence[Bounded]) -> dict[str, Any]:
    """Return the bound of each move, what each shaper takes, and a summary for each shaper."""
    return {
        "moves": [_row(one) for one in found],
        "bound_ms": _spread([one.bound for one in found]),
        "bound_with_lead_ms": _spread([one.with_lead for one in found]),
        "summary": {name: _summary(found, name) for name in found[0].judged},
    }


def _row(one: Bounded) -> dict[str, Any]:
    return {
        "name": one.name,
        "start": list(one.move.start),
        "target": list(one.move.target),
        "payload_kg": one.move.mass,
        "bound_ms": one.bound,
        "bound_with_lead_ms": one.with_lead,
        "shapers": {
            name: {
                "delay_ms": row["delay_ms"],
                "near": near(one, name),
                "reduction_percent": row["reduction_percent"],
            }
            for name, row in one.judged.items()
        },
    }


def near(one: Bounded, name: str) -> bool:
    """Return whether a shaper takes little more than the bound."""
    return bool(one.judged[name]["delay_ms"] <= SHARE * one.bound + MORE)


def _summary(found: Sequence[Bounded], name: str) -> dict[str, Any]:
    rows = [one.judged[name] for one in found]
    delays = np.array([row["delay_ms"] for row in rows])
    bounds = np.array([one.bound for one in found])
    reductions = [row["reduction_percent"] for row in rows if row["reduction_percent"] is not None]
    return {
        "delay_ms": _spread(delays.tolist()),
        "less_bound_ms": _spread((delays - bounds).tolist()),
        "near_percent": 100.0 * float(np.mean([near(one, name) for one in found])),
        "reduction_percent": _spread(reductions),
        "peak_acceleration_ratio": max(row["peak_acceleration_ratio"] for row in rows),
        "peak_velocity_ratio": max(row["peak_velocity_ratio"] for row in rows),
    }


def _spread(values: Sequence[float]) -> dict[str, float | None]:
    """Median, 5th percentile and both extremes; None without values."""
    shares = {"median": 50, "p5": 5, "min": 0, "max": 100}
    return {
        name: float(np.percentile(values, share)) if len(values) else None for name, share in shares.items()
    }


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the table of the shapers, that of the bounds and that of the moves."""
    summary = [
        [
            name,
            f"{one['delay_ms']['median']:.0f}",
            f"{one['less_bound_ms']['median']:.0f}",
            f"{one['near_percent']:.0f}",
            *(_percent(one["reduction_percent"][share]) for share in ("median", "p5", "min")),
            f"{one['peak_acceleration_ratio']:.3f}",
            f"{one['peak_velocity_ratio']:.3f}",
        ]
        for name, one in result["summary"].items()
    ]
    bounds = [
        [name, *(f"{value:.0f}" for value in result[key].values())]
        for name, key in (("without", "bound_ms"), ("with", "bound_with_lead_ms"))
    ]
    moves = [
        [row["name"], f"{row['payload_kg']:.1f}", f"{row['bound_ms']:.0f}"]
        + [
            cell
            for one in row["shapers"].values()
            for cell in (f"{one['delay_ms']:.0f}", _percent(one["reduction_percent"]))
        ]
        for row in result["moves"]
    ]
    columns: tuple[str, ...] = ("move", "kg", "bound ms")
    columns += tuple(f"{name} {what}" for name in result["summary"] for what in ("ms", "less %"))
    return [
        (SUMMARY, summary),
        (["feed-forward", *(f"bound ms, {name}" for name in result["bound_ms"])], bounds),
        (columns, moves),
    ]


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
