"""`tvist study bench`: all shapers on fifteen arms with the same moves and payloads, and around corners."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
import polars as pl

from tvist_lab.metrics.table import reduction_percent
from tvist_lab.recordings import Floats
from tvist_lab.studies.causality import inspect
from tvist_lab.study.arms import ARMS
from tvist_lab.study.case import Case
from tvist_lab.study.columns import Column, ResultTable, median, share
from tvist_lab.study.foreign import FromFile
from tvist_lab.study.held_out import MIN_MOVES
from tvist_lab.study.line import round_a_corner
from tvist_lab.study.measures import WORTH
from tvist_lab.study.method import Method, Named, Planned, Task
from tvist_lab.study.method_list import UNSHAPED
from tvist_lab.study.moves import Move
from tvist_lab.study.request import Preset, StudyRequest
from tvist_lab.study.shaping import ShaperFaultError
from tvist_lab.study.study import Figures, Result, Study, described
from tvist_lab.study.work import MEASURED
from tvist_plant.description import RobotDescription
from tvist_plant.variants import HEAVIER, Variant, rubbed

STICKS = "ur5e_stiction"
"""Robot file of the arms with sticking motors; their controller knows only this file and its calibration."""
STICKING = (
    Variant("stiction", "motors that stick near standstill, as the controller knows"),
    Variant("more_stiction", "motors that stick more than the controller knows", partial(rubbed, HEAVIER)),
)
PAYLOAD_ERRORS = (0.0, 0.1, -0.1)  # errors of the declared mass [-]
CORNERS = 5  # number of curved paths
KEPT = 1.003  # largest ratio of a peak to its limit that counts as within the limit [-]
ONCE = pl.col("arm") == pl.col("arm").first()  # the reference is the same for all arms


def _time(of: float, called: str) -> pl.Expr:
    found = pl.col("time_ms").quantile(of, "higher").round(6)  # equal times are ranked by vibration left
    return pl.when(found.is_finite()).then(found).alias(f"time_until_still_ms_{called}")


STILL = Column("still\nmedian ms", _time(0.5, "median"), 0,
               meaning="Last time |α| exceeds 0.1 m/s², from the stop of the unshaped reference.")  # fmt: skip
RING = Column("ring\nmedian m/s²", median("residual_m_s2"), 3,
              meaning="Envelope of α within 3 to 60 Hz after the shaped reference's own stop.")  # fmt: skip
STARRED = Column("shaper", lambda one: f"{one['shaper']} *" if one["pareto"] else one["shaper"])
COLUMNS = (
    STILL, Column("still\np90 ms", _time(0.9, "p90"), 0), RING,
    Column("less\nmedian %", share("less_percent", 0.5, "median"), 1,
           meaning="Reduction of ring compared with waiting."),
    Column("less\np5 %", share("less_percent", 0.05, "p5", MIN_MOVES), 1),
    Column("worst arm", "worst_arm", meaning="The arm with the smallest median of less."),
    Column("delay\nmedian ms", share("declared_delay_ms", 0.5, "median", among=ONCE), 0),
    Column("moving", pl.col("moving").median().alias("in_motion_ratio"), 2,
           meaning="Vibration during the motion relative to waiting."),
    *(Column(f"{sign}/limit", share(f"reference_{kind}_ratio", 1.0, "max", among=ONCE), 3, meaning="Largest peak.")
      for sign, kind in (("q̈", "acceleration"), ("q̇", "velocity"))),
    Column("bend\nmrad", "path_error_mrad", 1, meaning="Deviation from a path round a corner."),
    Column("µs", share("cost_us", 0.5, "median", among=ONCE), 0,
           meaning="Processor time per tick on this machine, including its estimates."),
)  # fmt: skip
MORE = (
    share("residual_m_s2", 0.9, "p90"), share("declared_delay_ms", 1.0, "max", among=ONCE),
    *(share(f"reference_{kind}_ratio", 0.5, "median", among=ONCE) for kind in ("acceleration", "velocity")),
    pl.col("time_ms").is_infinite().sum().alias("never_still"),
)  # fmt: skip


def study(asked: StudyRequest) -> Study:
    """Return the study: methods, moves and payload errors; if quick, each move has one error, in turn."""
    # Only the user's own shapers are inspected here; tests cover those of the package.
    theirs = [
        one
        for one in asked.methods
        if isinstance(one, FromFile) or (isinstance(one, Named) and one.recipe.own)
    ]
    faults = {one.name: why for one in theirs if (why := inspect(one, asked.description, asked.moves))}
    sound = [one for one in asked.methods if one.name not in faults]
    cases, arms = _cases(asked, sound, (*ARMS, *asked.arms)), (*ARMS, *asked.arms)
    if (sticking := asked.on(STICKS)) is not None:
        known = [one for one in sticking.methods if one.name not in faults]
        cases, arms = cases + _cases(sticking, known, STICKING), (*arms, *STICKING)
    return Study(
        title=f"{len(asked.moves)} moves on {len(arms)} arms with {len(PAYLOAD_ERRORS)} payload errors",
        cases=cases,
        pooled=("arm",),
        splits={"by_arm": ("arm",), "by_payload_error": ("payload_error",)},
        columns=COLUMNS,
        more=MORE,
        measures=("time_until_still_ms", "residual_m_s2", "in_motion_m_s2"),
        prepare=_beside_waiting,
        finish=lambda result: _rank(result, asked, faults),
        tables=lambda result: [
            ResultTable(
                f"{result.study.title}; * keeps the limits, and no other shaper that keeps them is better in both "
                "still and ring",
                ranked(result.values),
                (STARRED, *COLUMNS),
            )
        ],
        draw=_draw,
        as_served=False,
        facts={**asked.facts, "payload_errors": list(PAYLOAD_ERRORS)},
    )  # fmt: skip


def _beside_waiting(rows: pl.DataFrame) -> pl.DataFrame:
    """Add values to each row that compare it with the unshaped method for the same move on the same arm."""

    def waited(name: str) -> pl.Expr:
        return pl.col(name).filter(pl.col("shaper") == UNSHAPED).first().over("move", "payload_error", "arm")

    before = waited("residual_m_s2")
    return rows.with_columns(
        time_ms=pl.when(pl.col("status") == MEASURED).then(pl.col("time_until_still_ms").fill_null(math.inf)),
        less_percent=reduction_percent(pl.when(before >= WORTH).then(before), pl.col("residual_m_s2")),
        moving=pl.col("in_motion_m_s2") / waited("in_motion_m_s2"),
    )


def _cases(asked: StudyRequest, methods: Sequence[Method], arms: Sequence[Variant]) -> list[Case]:
    """Return the cases of arms whose controllers have the same robot file."""
    # If the calibration contains friction, it is fed forward for all methods of a case. Methods without a
    # calibration therefore need separate cases.
    parts = [tuple(one for one in methods if hasattr(one, "recipe") is has) for has in (True, False)]
    return [
        Case(
            asked.description, move, asked.seed + number, tuple(arms), payload_error=error, methods=part,
            axes={"move": number + 1, "payload_error": error},
        )
        for number, move in enumerate(asked.moves)
        for error in ((PAYLOAD_ERRORS[number % len(PAYLOAD_ERRORS)],) if asked.quick else PAYLOAD_ERRORS)
        for part in parts
        if part
    ]  # fmt: skip


def ranked(values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the entries that have a rank."""
    return [one for one in values["summary"] if one["ranked"]]


def _rank(result: Result, asked: StudyRequest, faults: Mapping[str, str]) -> None:
    """Order the summary by settling time; methods that cannot be ranked come last."""
    values, labels = result.values, {one.name: one for one in asked.methods}
    values["methods"] = described(labels.values())
    values["arms"] = {arm.name: arm.label for case in result.study.cases for arm in case.arms}
    found = {one["shaper"]: one for one in values["summary"]}
    wrong = dict(faults)
    for row in result.rows.filter(pl.col("error").is_not_null()).iter_rows(named=True):
        why = (
            f"{row['error'].removeprefix('the shaper ')} (payload error {100 * row['payload_error']:+.0f} %)"
        )
        wrong.setdefault(row["shaper"], why)
    entries = [found[name] | {"ranked": True} for name in labels if name in found and name not in wrong]
    for entry in entries:
        name = entry["shaper"]
        peaks = [entry[f"reference_{kind}_ratio_max"] for kind in ("acceleration", "velocity")]
        entry["keeps_limits"] = max(peaks) <= KEPT
        entry["path_error_mrad"] = bend(labels[name], asked.description, asked.moves)
        arms = [
            one
            for one in values["by_arm"]
            if one["shaper"] == name and one["less_percent_median"] is not None
        ]
        worst = min(arms, key=lambda one: float(one["less_percent_median"]), default=None)
        entry["worst_arm"] = worst and f"{worst['arm']} {worst['less_percent_median']:.1f}"
    entries.sort(key=_place)
    keeping = [one for one in entries if one["keeps_limits"]]
    for place, entry in enumerate(entries, 1):
        best = entry["keeps_limits"] and not any(_beats(other, entry) for other in keeping)
        entry |= {"place": place, "pareto": best}
    values["summary"] = [
        *entries,
        *({"shaper": name, "ranked": False, "fault": why} for name, why in wrong.items()),
    ]
    values["notes"] += [
        f"{name} ({labels[name].label}) is not ranked: it {why}" for name, why in wrong.items()
    ]
    if told := [one["shaper"] for one in entries if labels[one["shaper"]].needs_target]:
        values["notes"].append(f"these shapers are given the target before each move: {', '.join(told)}")
    if faults:
        values["failure"] = "; ".join(
            f"shaper {name} is not ranked: it {why}" for name, why in faults.items()
        )
    values["verdict"] = _verdict(entries, len(values["arms"]))


def _place(entry: Mapping[str, Any]) -> tuple[float, float]:
    """Return a method's sort key: settling time, infinite if it does not settle, then residual vibration."""
    still = entry["time_until_still_ms_median"]
    return (math.inf if still is None else still, entry["residual_m_s2_median"])


def _beats(other: Mapping[str, Any], entry: Mapping[str, Any]) -> bool:
    """Whether another method is better in settling time or residual vibration, and worse in neither."""
    ours, theirs = _place(entry), _place(other)
    return theirs != ours and theirs[0] <= ours[0] and theirs[1] <= ours[1]


def _verdict(entries: Sequence[Mapping[str, Any]], arms: int) -> list[str]:
    still = [one for one in entries if one["keeps_limits"] and one["time_until_still_ms_median"] is not None]
    if not still:
        return ["No shaper that keeps the limits brings the arms to rest."]
    first, quiet = still[0], min(still, key=lambda one: float(one["residual_m_s2_median"]))
    less, late = first["less_percent_median"], first["time_until_still_ms_median"]
    lead = (
        f"Of those that keep the limits, {first['shaper']} is at rest first: {late:.0f} ms "
        f"after the unshaped stop (median over {arms} arms)"
        + ("." if less is None else f", with {less:.0f} % less vibration than waiting.")
    )
    if quiet is first:
        return [lead, "It also leaves the least vibration."]
    return [lead, f"{quiet['shaper']} leaves the least vibration: {quiet['residual_m_s2_median']:.3f} m/s²."]


def _draw(result: Result) -> Figures:
    from tvist_lab.figures import pareto_figure, settling_figure

    entries = ranked(result.values)
    return {
        "pareto": (pareto_figure(entries), "Settling time against residual vibration."),
        "settling_measured": (settling_figure(entries), "Settling time against delay."),
    }


def bend(method: Method, description: RobotDescription, moves: Sequence[Move]) -> float | None:
    """Return a method's largest deviation from paths around a corner to another start [mrad].

    None for methods that plan motions, or cannot shape the paths.
    """
    if isinstance(method, Planned):
        return None
    found: list[float] = []
    for first, second in zip(moves[:CORNERS], [*moves[1:], moves[0]], strict=False):
        start, corner, target = (np.array(q) for q in (first.start, first.target, second.start))
        reference = round_a_corner(start, corner, target)
        task = Task(description, Move(first.start, second.start, first.mass), reference)
        with suppress(ShaperFaultError):
            found.append(path_error(reference, method.shaped(task).q))
    return 1e3 * max(found) if found else None


def path_error(path: Floats, q: Floats) -> float:
    """Return the largest distance of points from a path in joint space, regardless of time [rad]."""
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


PRESET = Preset(study, always=(UNSHAPED,), defaults="bench", options=frozenset(("quick",)))
