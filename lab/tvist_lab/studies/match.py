"""`tvist study match`: compare two shapers on the same moves and plants, and test the difference.

Both shapers make each move on each plant, so the difference does not depend on how hard a move is. The
interval of the median difference is exact for any distribution: its ends are where a sign test at 5 % starts
to reject. The interval of the 5th percentiles' difference is a percentile bootstrap over pairs. With few
moves in the tail, this interval is too narrow; it is shown but not used for a verdict.
"""

from collections.abc import Sequence

import numpy as np
import polars as pl
from scipy.stats import binom

from tvist_lab.phrases import counted
from tvist_lab.recordings import Floats
from tvist_lab.study.arms import JUDGED
from tvist_lab.study.columns import Column, of_group, share
from tvist_lab.study.held_out import MIN_MOVES, bootstrap
from tvist_lab.study.request import Preset, StudyRequest
from tvist_lab.study.study import Study, StudyError
from tvist_plant.variants import variant

NEITHER, TOO_FEW = "no difference shown", "too few moves vibrate"
FIRST, SECOND = (pl.col(f"{place}_percent") for place in ("first", "second"))
DIFFERENCE = (FIRST - SECOND).alias("difference")
BOOTSTRAP = "Of the 5th percentiles, first minus second in points, with its 95 % interval, a bootstrap."
EXACT = "Of the medians, first minus second in points, with its 95 % interval, which is exact."


def study(asked: StudyRequest) -> Study:
    """Return the study of two shapers, side by side."""
    if len(asked.methods) != 2:
        raise StudyError(f"shapers names {counted(len(asked.methods), 'shaper')}: must be two different ones")
    moves, names = asked.feasible(), [one.name for one in asked.methods]
    if len(moves) < MIN_MOVES:
        raise StudyError(
            f"only {len(moves)} of {len(asked.moves)} moves are within the drives' torque at these limits; at least "
            f"{MIN_MOVES} are needed"
        )
    weak = len(asked.moves) - len(moves)
    both = [(name, word) for name, word in zip(names, ("first", "second"), strict=True)]
    return Study(
        title=f"Reduction by {' and '.join(names)}",
        cases=asked.cases(moves, asked.arms or [variant(name) for name in JUDGED]),
        methods=asked.methods,
        by=("arm",),
        pooled=("shaper",),
        measures=("reduction_percent", "delay_ms"),
        prepare=lambda rows: _paired(rows, names),
        columns=(
            Column("moves", DIFFERENCE.count().alias("moves"), 0, meaning="Those that vibrate enough."),
            *(column for name, word in both for column in _columns(name, word)),
            Column("difference\nmedian", DIFFERENCE.median().alias("difference_median"), 1, meaning=EXACT),
            Column("95 %\nexact", of_group(_exact, [DIFFERENCE], pl.List(pl.Float64), "difference_median_interval"), 1),
            Column("difference\np5", of_group(_between, [FIRST, SECOND], pl.Float64, "difference_p5"), 1),
            Column("95 %\nbootstrap", of_group(_of_p5, [FIRST, SECOND], pl.List(pl.Float64), "difference_p5_interval"),
                   1, meaning=BOOTSTRAP),
            Column("verdict", of_group(lambda found: verdict(found, *names), [DIFFERENCE], pl.String, "verdict"),
                   meaning="The interval of the median is on one side of zero, for each plant by itself."),
        ),
        draw=lambda _: {},
        facts=asked.facts,
        notes=f"{weak} further moves were left out: the drives are too weak" if weak else "",
    )  # fmt: skip


def _paired(rows: pl.DataFrame, names: Sequence[str]) -> pl.DataFrame:
    """Put both shapers' results for a move on an arm into the first shaper's row; drop the other row."""
    columns = {
        f"{word}_{short}": pl.col(measure).filter(pl.col("shaper") == name).first().over("arm", "move")
        for name, word in zip(names, ("first", "second"), strict=True)
        for measure, short in (("reduction_percent", "percent"), ("delay_ms", "delay_ms"))
    }
    return rows.with_columns(**columns).filter(pl.col("shaper") == names[0])


def _columns(name: str, word: str) -> list[Column]:
    counts = DIFFERENCE.is_not_null()
    return [
        Column(f"{name}\nmedian %", share(f"{word}_percent", 0.5, "median", among=counts), 1),
        Column(f"{name}\np5 %", share(f"{word}_percent", 0.05, "p5", MIN_MOVES, among=counts), 1),
        Column(f"{name}\ndelay ms", share(f"{word}_delay_ms", 0.5, "median"), 0),
    ]


def _exact(differences: Floats) -> list[float] | None:
    return exact_interval(differences) if len(differences) >= MIN_MOVES else None


def exact_interval(differences: Floats) -> list[float]:
    """Return the interval that contains a distribution's median with at least 95 % probability, whatever its form."""
    ordered = np.sort(differences)
    outside = int(binom.ppf(0.025, len(ordered), 0.5))  # P(fewer are below the median) is less than 2.5 %
    return [float(ordered[outside - 1]), float(ordered[len(ordered) - outside])]


def verdict(differences: Floats, first: str, second: str) -> str:
    """Return which shaper is better, by the exact interval of the median of first minus second."""
    found = _exact(differences)
    if found is None:
        return TOO_FEW
    return f"{first} better" if found[0] > 0.0 else f"{second} better" if found[1] < 0.0 else NEITHER


def _between(first: Floats, second: Floats) -> float | None:
    return float(np.percentile(first, 5.0) - np.percentile(second, 5.0)) if len(first) >= MIN_MOVES else None


def _of_p5(first: Floats, second: Floats) -> list[float] | None:
    def between(drawn: Floats) -> Floats:
        p5 = np.percentile(drawn, 5.0, axis=1)
        return np.asarray(p5[:, 0] - p5[:, 1])

    return bootstrap(np.column_stack([first, second]), between) if len(first) >= MIN_MOVES else None


PRESET = Preset(study, options=frozenset(("plants", "limits", "modes")), least=MIN_MOVES)
