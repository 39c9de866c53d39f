"""What is left of a motion that is made again and again by a robot that learns, inside it and through a bridge."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proof.bridge.in_lockstep import Bridge, HiddenRobot, Link
from proof.bridge.motions import ROBOTS, SPEEDS, Asked, made
from tvist_controller.api.line import paper_payload
from tvist_plant.description import load


def report(robots: int, seed: int, repetitions: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Let hidden robots, of two models in turn, move between Q1 and Q2 again and again.

    Args:
        robots: Number of robots.
        seed: Seed of the first of them.
        repetitions: How often each motion is made.
        tell: Takes a line of progress.
    """
    rows = []
    for number in range(robots):
        name, own = ROBOTS[number % len(ROBOTS)], seed + number
        description = load(name)
        payload, start = paper_payload(description), np.array(description.poses["Q1"])
        there = Asked(np.array(description.poses["Q2"]), SPEEDS[0])
        motions = [there, Asked(start, SPEEDS[0])] * repetitions
        plain = np.mean(made(HiddenRobot(description, own, start, payload), motions[:2]).peaks)
        inside = HiddenRobot(description, own, start, payload, "auto", learns=True)
        through = Bridge(description, own, start, payload, "auto", Link(), learns=True)
        for where, side in (("inside", inside), ("through", through)):
            done = made(side, motions)
            peaks = np.reshape(done.peaks[: len(done.peaks) // 2 * 2], (-1, 2)).mean(axis=1)
            less = (100.0 * (1.0 - peaks / plain)).tolist()
            rows.append({"robot": name, "seed": own, "where": where, "stops": len(done.stops), "less": less})
            tell(f"{name}, seed {own}, {where}: {less[0]:.1f} to {less[-1]:.1f} %")
    return {"rows": rows}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return the reductions of each repetition [%] as a table."""
    rows = [
        [
            row["robot"],
            str(row["seed"]),
            row["where"],
            str(row["stops"]),
            *(f"{one:.1f}" for one in row["less"]),
        ]
        for row in result["rows"]
    ]
    columns = [
        "robot",
        "seed",
        "where",
        "stops",
        *(f"{k + 1}" for k in range(max(len(row) for row in rows) - 4)),
    ]
    return [(columns, rows)]
