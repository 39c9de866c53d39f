"""Two methods on the same moves and plants: the differences of their reductions, and whether they show anything.

Each move is made by both on each plant, so its difference does not depend on how hard the move is. The interval of the
median difference is exact for any distribution: its ends are the differences between which a sign test at 5 % rejects
no median. That of the 5th percentiles' difference is a percentile bootstrap over pairs, which is too narrow for so few
moves in the tail: it is shown, and no verdict hangs on it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import binom

from tvist_controller.api.line import MotionLimits
from tvist_lab.recordings import Floats
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.held_out import LEAST, bootstrap, median_and_p5
from tvist_lab.study.method import Method
from tvist_lab.study.moves import Move
from tvist_lab.study.tables import Entry, Shown
from tvist_lab.study.work import Job, Row
from tvist_plant.description import RobotDescription
from tvist_plant.variants import Variant

WANTED = ("reduction_percent", "delay_ms")
"""Measures of each motion."""
FIRST, SECOND, NEITHER, TOO_FEW = "first", "second", "no difference shown", "too few moves vibrate"
"""Verdicts: which method is better."""


def jobs(
    description: RobotDescription,
    pair: tuple[Method, Method],
    plants: Sequence[Variant],
    moves: Sequence[Move],
    seed: int,
    limits: MotionLimits,
) -> list[Job]:
    """Return a job for each move: by both methods on all plants, as a robot makes it.

    Raises:
        ValueError: There are fewer than `LEAST` moves.
    """
    if len(moves) < LEAST:
        raise ValueError(
            f"there are {len(moves)} moves: must be at least {LEAST}, since fewer show hardly any difference"
        )
    arms = tuple({one.name: one for one in plants}.values())
    return [
        Job(Case(description, move, arm_seed(seed, place), arms, limits, axes={"move": place}), pair, WANTED)
        for place, move in enumerate(moves)
    ]


def report(
    pair: tuple[Method, Method], plants: Sequence[Variant], rows: Sequence[Row]
) -> list[dict[str, Any]]:
    """Return an entry for each plant; moves without vibration do not count."""
    by_plant: dict[str, dict[str, dict[int, Row]]] = {}
    for row in rows:
        by_plant.setdefault(row["arm"], {}).setdefault(row["shaper"], {})[row["move"]] = row
    return [
        {"name": one.name, "label": one.label, **_entry(*(by_plant[one.name][each.name] for each in pair))}
        for one in {one.name: one for one in plants}.values()
    ]


def _entry(first: dict[int, Row], second: dict[int, Row]) -> dict[str, Any]:
    counted = [move for move, row in first.items() if row["reduction_percent"] is not None]
    both = np.array([[one[move]["reduction_percent"] for one in (first, second)] for move in counted])
    both = both.reshape(-1, 2)
    differences = both[:, 0] - both[:, 1]
    enough = len(counted) >= LEAST
    middle = exact_interval(differences) if enough else None
    shares = [median_and_p5(column) for column in both.T]
    p5 = [one["p5"] for one in shares]
    return {
        "moves": len(counted),
        **{
            name: {
                "reduction_percent": share,
                "delay_ms": round(float(np.median([row["delay_ms"] for row in made.values()])), 6),
            }
            for name, share, made in zip((FIRST, SECOND), shares, (first, second), strict=True)
        },
        "difference": {
            "median": float(np.median(differences)) if counted else None,
            "median_interval": middle,
            "p5": None if p5[0] is None or p5[1] is None else p5[0] - p5[1],
            "p5_interval": bootstrap(both, _between_p5) if enough else None,
        },
        "verdict": TOO_FEW if middle is None else verdict(middle),
    }


def exact_interval(differences: Floats) -> list[float]:
    """Interval that contains the median of a distribution with at least 95 % probability, whatever that is like.

    Args:
        differences: Independent values, at least 6, shape (n,).
    """
    ordered = np.sort(differences)
    outside = int(binom.ppf(0.025, len(ordered), 0.5))  # P(fewer lie below the median) is less than 2.5 %
    return [float(ordered[outside - 1]), float(ordered[len(ordered) - outside])]


def verdict(interval: Sequence[float]) -> str:
    """Return what an interval of the median difference, first minus second, shows."""
    low, high = interval
    return FIRST if low > 0.0 else SECOND if high < 0.0 else NEITHER


def _between_p5(drawn: Floats) -> Floats:
    p5 = np.percentile(drawn, 5.0, axis=1)
    return np.asarray(p5[:, 0] - p5[:, 1])


def table(first: str, second: str) -> list[Shown]:
    """Columns of the table.

    Args:
        first: Name of the first method.
        second: Name of the second method.
    """

    def said(entry: Entry) -> str:
        found = entry["verdict"]
        return f"{ {FIRST: first, SECOND: second}[found] } better" if found in {FIRST, SECOND} else found

    def sure(name: str) -> Shown:
        def text(entry: Entry) -> str | None:
            value, ends = entry["difference"][name], entry["difference"][f"{name}_interval"]
            if value is None:
                return None
            return f"{value:+.1f}" + ("" if ends is None else f" [{ends[0]:+.1f}, {ends[1]:+.1f}]")

        return Shown(f"difference {name}", text)

    def of(key: str, name: str) -> list[Shown]:
        return [
            Shown(f"{name} median", f"{key}.reduction_percent.median", 1),
            Shown("p5", f"{key}.reduction_percent.p5", 1),
            Shown("delay ms", f"{key}.delay_ms", 0),
        ]

    return [
        Shown("plant", "name"), Shown("moves", "moves", 0), *of(FIRST, first), *of(SECOND, second), sure("median"),
        sure("p5"), Shown("verdict", said),
    ]  # fmt: skip
