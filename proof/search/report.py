"""All searches, on all cores, and their results."""

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from proof.search import changes, programs, sequences, stops, streams
from tvist_lab.runners import in_order
from tvist_plant.description import RobotDescription, load

Judge: TypeAlias = Callable[[RobotDescription, int], Any]
"""Tries a case by its number on a robot; returns its outcome, or a sentence if it broke a promise and has none."""
APART = 1_000_000
"""Difference between the case numbers of two consecutive seeds."""
PROGRAMS = 3
"""One in so many sequences of commands contains programs."""


@dataclass(frozen=True)
class Counts:
    """Number of cases of each search."""

    stops: int = 0
    streams: int = 0
    changes: int = 0
    sequences: int = 0

    @property
    def all(self) -> int:
        """Total number of cases."""
        return self.stops + self.streams + self.changes + self.sequences


def search(
    counts: Counts,
    seed: int,
    *,
    robots: Sequence[str] = ("ur5e",),
    flexible: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run all searches.

    Args:
        counts: Number of cases of each search.
        seed: Seed of the cases.
        robots: Robot files, or names of robots that come with the package; they take turns.
        flexible: Whether to simulate the flexible arm in stops and streams as well, to see how far it enters the
            clearance that the reference keeps.
        progress: Called after each case with the search it belongs to.

    Returns:
        For each requested search: count, `broken` with a sentence for each violated guarantee, and figures.
    """
    arms = [load(robot) for robot in robots]
    result: dict[str, Any] = {"seed": seed, "robots": list(robots), "flexible": flexible}

    def run(what: str, count: int, judge: Judge) -> tuple[dict[str, Any], list[Any]]:
        tasks = [(arms[case % len(arms)], seed * APART + case) for case in range(count)]
        outcomes, wrong = [], []
        for (arm, number), found in zip(tasks, in_order(partial(_try, judge), tasks), strict=True):
            if not isinstance(found, str | None):
                outcomes.append(found)
            if isinstance(found, str) or (found is not None and not found.kept):
                wrong.append(f"{arm.robot.name}, {what} {number}: {found}")
            progress(what)
        return {"count": count, "broken": wrong}, outcomes

    if counts.stops:
        part, stopped = run("stops", counts.stops, partial(_stop, flexible))
        result["stops"] = part | (_stops(stopped) if stopped else {})
    if counts.streams:
        part, streamed = run("streams", counts.streams, partial(_stream, flexible))
        result["streams"] = part | (_streams(streamed) if streamed else {})
    if counts.changes:
        part, changed = run("changes", counts.changes, changes.judge)
        result["changes"] = part | {"refused": sum(one.refused for one in changed)}
    if counts.sequences:
        result["sequences"], _ = run("sequences", counts.sequences, partial(_sequence, len(arms)))
    return result


def broken(result: dict[str, Any]) -> list[str]:
    """Return a sentence for each guarantee that a search found violated."""
    return [one for part in result.values() if isinstance(part, dict) for one in part["broken"]]


def _try(judge: Judge, task: tuple[RobotDescription, int]) -> Any:
    """Judge a case; an exception of the robot breaks a promise, too."""
    try:
        return judge(*task)
    except Exception as error:  # noqa: BLE001
        return "".join(traceback.format_exception(error, limit=-3))


def _stop(flexible: bool, description: RobotDescription, number: int) -> stops.Outcome:
    return stops.judge(description, stops.draw(description, number), flexible=flexible)


def _stream(flexible: bool, description: RobotDescription, number: int) -> streams.StreamOutcome:
    return streams.judge(description, streams.draw(description, number), flexible=flexible)


def _sequence(robots: int, description: RobotDescription, number: int) -> str | None:
    kind = programs.ProgramSequence if number // robots % PROGRAMS == PROGRAMS - 1 else sequences.Sequence
    try:
        kind(description, number).run()
    except sequences.BrokenError as error:
        return str(error)
    return None


def _stops(outcomes: Sequence[stops.Outcome]) -> dict[str, Any]:
    kinds = {}
    for kind in stops.KINDS:
        of_kind = [one for one in outcomes if one.case.kind == kind]
        if of_kind:
            lasted = np.array([one.duration for one in of_kind])
            share = [one.duration / max(one.left, 1e-3) for one in of_kind]
            kinds[kind] = {
                "count": len(of_kind),
                "duration_s": {"median": float(np.median(lasted)), "max": float(lasted.max())},
                "share_of_time_left": {"median": float(np.median(share)), "max": float(max(share))},
                "ran_out": sum(one.late == 0 for one in of_kind),
            }
    return {
        "worst_torque_of_moves_share": max(one.heavy for one in outcomes),
        "worst_ahead_rad": max(one.ahead for one in outcomes),
        "worst_off_rad": max(one.off for one in outcomes),
        "worst_late_ticks": max(one.late for one in outcomes),
        "worst_torque_share": max(one.torque for one in outcomes),
        **_nearest(outcomes),
        "kinds": kinds,
    }


def _streams(outcomes: Sequence[streams.StreamOutcome]) -> dict[str, Any]:
    return {
        "stopped_by_the_robot": sum(one.stopped for one in outcomes),
        **_nearest(outcomes),
    }


def _nearest(outcomes: Sequence[stops.Outcome | streams.StreamOutcome]) -> dict[str, Any]:
    """Return the highest speeds, and the smallest distance of two bodies: by the reference and by the flexible arm."""
    arm = [one.penetration for one in outcomes if not np.isnan(one.penetration)]
    return {
        "worst_velocity_share": max(one.speeds[0] for one in outcomes),
        "worst_acceleration_share": max(one.speeds[1] for one in outcomes),
        "worst_below_clearance_m": max(one.near for one in outcomes),
        "worst_penetration_of_the_flexible_arm_m": max(arm) if arm else None,
    }


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the table of the figures of each search, and that of the kinds of stops."""
    parts = {name: part for name, part in result.items() if isinstance(part, dict)}
    figures = dict.fromkeys(key for part in parts.values() for key in part if key != "kinds")
    rows = [[key, *(_figure(part.get(key)) for part in parts.values())] for key in figures]
    found: list[tuple[Sequence[str], list[list[str]]]] = [(("figure", *parts), rows)]
    if kinds := parts.get("stops", {}).get("kinds"):
        columns = (
            "kind",
            "cases",
            "duration, median [s]",
            "maximum [s]",
            "of the time left, median",
            "ran out",
        )
        found.append((columns, [_kind(name, one) for name, one in kinds.items()]))
    return found


def _figure(value: Any) -> str:
    """Return a figure, the number of broken promises, or a dash where there is none."""
    return "–" if value is None else f"{len(value) if isinstance(value, list) else value:.4g}"


def _kind(name: str, one: dict[str, Any]) -> list[str]:
    lasted, share = one["duration_s"], one["share_of_time_left"]
    figures = (one["count"], lasted["median"], lasted["max"], share["median"], one["ran_out"])
    return [name, *(f"{value:.3g}" for value in figures)]
