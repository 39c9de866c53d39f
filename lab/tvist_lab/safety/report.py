"""All searches, on all cores, and their results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np

from tvist_lab.runners import Processes, in_order
from tvist_lab.safety import changes, programs, sequences, stops, streams
from tvist_plant.description import RobotDescription, load

T = TypeVar("T")

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
    robot: str = "ur5e",
    flexible: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run all searches.

    Args:
        counts: Number of cases of each search.
        seed: Seed of the cases.
        robot: Robot file, or name of a robot that comes with the package.
        flexible: Whether to simulate the flexible arm in stops and streams as well, to see how far it enters the
            clearance that the reference keeps.
        progress: Called after each case with the search it belongs to.

    Returns:
        For each requested search: count, `broken` with a sentence for each violated guarantee, and figures.
    """
    description = load(robot)
    result: dict[str, Any] = {"seed": seed, "robot": robot, "flexible": flexible}

    def run(what: str, count: int, work: Callable[[int], T]) -> list[T]:
        found = []
        for one in in_order(Processes(), work, range(seed * APART, seed * APART + count)):
            found.append(one)
            progress(what)
        return found

    if counts.stops:
        stopped = run("stops", counts.stops, partial(_stop, description, flexible))
        result["stops"] = _stops(stopped)
    if counts.streams:
        streamed = run("streams", counts.streams, partial(_stream, description, flexible))
        result["streams"] = _streams(streamed)
    if counts.changes:
        changed = run("changes", counts.changes, partial(changes.judge, description))
        result["changes"] = {**_judged(changed), "refused": sum(one.refused for one in changed)}
    if counts.sequences:
        told = run("sequences", counts.sequences, partial(_sequence, description))
        result["sequences"] = {"count": len(told), "broken": [one for one in told if one is not None]}
    return result


def broken(result: dict[str, Any]) -> list[str]:
    """Return a sentence for each guarantee that a search found violated."""
    return [one for part in result.values() if isinstance(part, dict) for one in part["broken"]]


def _stop(description: RobotDescription, flexible: bool, number: int) -> stops.Outcome:
    return stops.judge(description, stops.draw(description, number), flexible=flexible)


def _stream(description: RobotDescription, flexible: bool, number: int) -> streams.StreamOutcome:
    return streams.judge(description, streams.draw(description, number), flexible=flexible)


def _sequence(description: RobotDescription, number: int) -> str | None:
    kind = programs.ProgramSequence if number % PROGRAMS == PROGRAMS - 1 else sequences.Sequence
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
        **_judged(outcomes),
        "worst_ahead_rad": max(one.ahead for one in outcomes),
        "worst_off_rad": max(one.off for one in outcomes),
        "worst_late_ticks": max(one.late for one in outcomes),
        "worst_torque_share": max(one.torque for one in outcomes),
        **_nearest(outcomes),
        "kinds": kinds,
    }


def _streams(outcomes: Sequence[streams.StreamOutcome]) -> dict[str, Any]:
    return {
        **_judged(outcomes),
        "stopped_by_the_robot": sum(one.stopped for one in outcomes),
        **_nearest(outcomes),
    }


def _judged(
    outcomes: Sequence[stops.Outcome | streams.StreamOutcome | changes.ChangeOutcome],
) -> dict[str, Any]:
    """Return the number of cases, and those that violated a guarantee."""
    return {"count": len(outcomes), "broken": [repr(one) for one in outcomes if not one.kept]}


def _nearest(outcomes: Sequence[stops.Outcome | streams.StreamOutcome]) -> dict[str, Any]:
    """Return the smallest distance between two bodies, for the reference and, if simulated, the flexible arm."""
    arm = [one.penetration for one in outcomes if not np.isnan(one.penetration)]
    return {
        "worst_below_clearance_m": max(one.near for one in outcomes),
        "worst_penetration_of_the_flexible_arm_m": max(arm) if arm else None,
    }
