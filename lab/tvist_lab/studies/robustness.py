"""`tvist study robustness`: shapers on arms that differ from the calibration or the declared payload."""

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from tvist_lab.metrics.table import reduction_percent
from tvist_lab.study.arms import PERTURBED
from tvist_lab.study.case import Case
from tvist_lab.study.columns import Column, ResultTable, across, median, p5
from tvist_lab.study.held_out import MIN_MOVES, interval_of
from tvist_lab.study.measures import QUIET_LEVEL
from tvist_lab.study.request import Preset, StudyRequest
from tvist_lab.study.study import Figures, Result, Study
from tvist_plant.variants import AS_DESCRIBED, Variant, variant, with_springs

ERRORS: dict[str, tuple[float, ...]] = {
    "stiffness": (-0.3, -0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2, 0.3),
    "payload": (-0.2, -0.1, 0.0, 0.1, 0.2),
}
"""Relative errors [-]: how much stiffer all springs are than calibrated, and how much the declared mass
exceeds the carried one."""
PLANT = "plant"  # kind of error of a named plant
LESS = Column("median", median("reduction_percent"), 1)
WORST = Column("p5", p5("reduction_percent", MIN_MOVES), 1)
BOTH = Column("median / p5", lambda one: f"{LESS.text(one)} / {WORST.text(one)}")
DELAY = Column("delay ms", median("delay_ms"), 0)
BEYOND = reduction_percent(pl.col("waited_peak_m_s2"), pl.col("shaped_peak_m_s2"))
"""Reduction compared with an unshaped motion, after the time at which the shaped motion stops [%]."""
WAITED = pl.col("reduction_percent").is_not_null() & (pl.col("waited_peak_m_s2") >= QUIET_LEVEL)


def study(asked: StudyRequest) -> Study:
    """Return the study: a case per payload error and move, by all shapers on all arms with this error."""
    wrong = errors(asked.arms)
    arms: dict[float, dict[str, Variant]] = {}
    for kind in wrong.values():
        for arm, error in kind.values():
            arms.setdefault(error, {})[arm.name] = arm
    cases = [
        Case(
            asked.description, move, asked.seed + number, tuple(those.values()), payload_error=error,
            axes={"payload_error": error, "move": number + 1},
        )
        for error, those in sorted(arms.items(), key=lambda one: abs(one[0]))
        for number, move in enumerate(asked.moves)
    ]  # fmt: skip
    return Study(
        title="Reduction on arms that are not as calibrated",
        cases=cases,
        methods=asked.methods,
        pooled=("arm",),
        splits={"cells": ("arm", "payload_error")},
        columns=(LESS, WORST, DELAY),
        more=(
            pl.col("reduction_percent").count().alias("counted"),
            interval_of("reduction_percent", 50.0, "median"), interval_of("reduction_percent", 5.0, "p5", MIN_MOVES),
            BEYOND.filter(WAITED).median().alias("beyond_waiting_percent_median"),
            pl.when(WAITED.sum() >= MIN_MOVES).then(BEYOND.filter(WAITED).quantile(0.05, "linear"))
            .alias("beyond_waiting_percent_p5"),
        ),
        measures=(),
        as_served=False,
        finish=lambda result: result.values["summary"].sort(key=lambda one: (one["delay_ms_median"], one["shaper"])),
        tables=lambda result: [
            table for kind in cells(result.values) for table in tables(result.values, kind, [BOTH])
        ],
        draw=_draw,
        facts=asked.facts,
    )  # fmt: skip


def errors(named: Sequence[Variant] = ()) -> dict[str, dict[str, tuple[Variant, float]]]:
    """Return for each kind of error the tables' columns: by title, arm and the declared mass's error [-]."""
    return {
        "stiffness": {f"{100.0 * one:+.0f} %": (with_springs(1.0 + one), 0.0) for one in ERRORS["stiffness"]},
        "payload": {f"{100.0 * one:+.0f} %": (AS_DESCRIBED, one) for one in ERRORS["payload"]},
        PLANT: {one.name: (one, 0.0) for one in [*map(variant, PERTURBED), *named]},
    }


def cells(values: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Return for each kind of error the tables' entries, in the summary's order, with the column's title."""
    found = {(one["shaper"], one["arm"], one["payload_error"]): one for one in values["cells"]}
    delays = {one["shaper"]: one["delay_ms_median"] for one in values["summary"]}
    known = {arm for one in errors().values() for arm, _ in one.values()}
    hidden = [
        Variant(name, label)
        for name, label in values["arms"].items()
        if name not in {arm.name for arm in known}
    ]
    return {
        kind: [
            {**found[name, arm.name, error], "error": title, "delay_ms_median": delay}
            for name, delay in delays.items()
            for title, (arm, error) in those.items()
        ]
        for kind, those in errors(hidden).items()
    }


def tables(values: Mapping[str, Any], kind: str, shown: Sequence[Column]) -> list[ResultTable]:
    """Return the tables for one kind of error, with a column for each error."""
    title = "Plants by name" if kind == PLANT else f"Wrong {kind}"
    found = [across(cells(values)[kind], "shaper", "error", one, [DELAY]) for one in shown]
    return [ResultTable(f"{title}: {one.title}", one.entries, one.columns) for one in found]


def _draw(result: Result) -> Figures:
    from tvist_lab.figures import robustness_figure

    return {
        "robustness": (
            robustness_figure(cells(result.values), ERRORS),
            "Reduction against delay, for each error.",
        )
    }


PRESET = Preset(study, defaults="robustness")
