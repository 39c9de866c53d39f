"""`tvist study moves`: any moves by shapers and baselines, each compared with the unshaped move."""

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from tvist_lab.phrases import QUANTILES_FROM, either, sample, spread
from tvist_lab.study.columns import Column, ResultTable, highest, lowest, median, p5, p90, share
from tvist_lab.study.held_out import interval_of
from tvist_lab.study.measures import WORTH
from tvist_lab.study.method import WaitingMethod
from tvist_lab.study.request import Preset, StudyRequest
from tvist_lab.study.study import Figures, Result, Study
from tvist_lab.study.work import MEASURED, record
from tvist_plant.variants import AS_DESCRIBED

COUNTED = pl.col("reduction_percent").is_not_null()  # selects rows with enough vibration for a percentage
LESS = "Reduction of the largest acceleration of the tool, later than 10 ms after the reference stops."
WAITED = "The same against an unshaped arm that waits as long as the shaper is late."
STILL = "Last time |α| exceeds 0.1 m/s², from the stop of the unshaped reference."
DRIVEN = Column(
    "largest q̈\nof its limit",
    highest("peak_acceleration_ratio"),
    3,
    meaning="Largest acceleration of a joint.",
)
COLUMNS = (
    Column("less\nmedian %", median("reduction_percent"), 1, meaning=LESS),
    Column("less\np5 %", p5("reduction_percent"), 1),
    Column("less than waiting\nmedian %", median("less_than_waiting_percent"), 1, meaning=WAITED),
    Column("delay\nmedian ms", median("delay_ms"), 0, meaning="Time by which shaping lengthens a move."),
    Column("still\nmedian ms", median("still_after_unshaped_stop_ms"), 0, meaning=STILL),
    Column("still\np90 ms", p90("still_after_unshaped_stop_ms"), 0), DRIVEN,
)  # fmt: skip
MORE = (
    Column("95 % interval\nof the median", interval_of("reduction_percent", 50, "median"), 1,
           meaning="Bootstrap over the moves, of the median of less."),
    Column("quiet\nmedian ms", median("quiet_after_unshaped_stop_ms"), 0, meaning="As still, but of 0.02 m/s²."),
    Column("peak\nmedian m/s²", share("shaped_peak_m_s2", 0.5, "median", among=COUNTED), 3,
           meaning="Largest acceleration of the tool after the stop."),
    Column("largest q̇\nof its limit", highest("peak_velocity_ratio"), 3, meaning="Largest velocity of a joint."),
)  # fmt: skip
FEW_COLUMNS = (
    Column("less\nleast %", lowest("reduction_percent"), 1, meaning=LESS),
    Column("less than waiting\nleast %", lowest("less_than_waiting_percent"), 1, meaning=WAITED),
    Column("delay\nlongest ms", highest("delay_ms"), 0, meaning="Time by which shaping lengthens a move."),
    Column("still\nlatest ms", highest("still_after_unshaped_stop_ms"), 0, meaning=STILL), DRIVEN,
)  # fmt: skip
"""Columns if there are fewer moves than a median needs."""
EACH = (
    Column("move", "move"), Column("payload\nkg", "payload_kg", 2), Column("unshaped\nm/s²", "unshaped_peak_m_s2", 3),
    Column("shaped\nm/s²", "shaped_peak_m_s2", 3), Column("less\n%", "reduction_percent", 1),
    Column("delay\nms", "delay_ms", 0), Column("still\nms", "still_after_unshaped_stop_ms", 0),
    Column("largest q̈\nof its limit", "peak_acceleration_ratio", 3),
)  # fmt: skip
SUMMED = (
    COUNTED.sum().alias("counted"), interval_of("reduction_percent", 5, "p5"),
    *(share("shaped_peak_m_s2", of, name, among=COUNTED) for name, of in (("p95", 0.95), ("max", 1.0))),
    pl.col("shaped_peak_m_s2").filter(~COUNTED).max().alias("left_out_largest_peak_m_s2"),
    *(of(name) for name in ("peak_acceleration_ratio", "peak_velocity_ratio") for of in (median, p90)),
    *(of("quiet_after_unshaped_stop_ms") for of in (p90, highest)), p5("less_than_waiting_percent"),
    ((pl.col("status") == MEASURED) & pl.col("shaped_still_after_ms").is_null()).sum().alias("never_still"),
)  # fmt: skip
"""Further values for --json."""


def study(asked: StudyRequest) -> Study:
    """Return the study of these moves by these shapers, waiting, and the baselines."""
    moves = asked.feasible()
    named, others = asked.methods[: asked.named], asked.methods[asked.named :]
    if asked.streams:  # a shaper does not know the end of a stream
        others = [one for one in others if not one.needs_target]
    weak, notes = len(asked.moves) - len(moves), list(asked.notes)
    if weak:
        notes.append(f"{weak} of {len(asked.moves)} moves were left out: the drives are too weak")
    return Study(
        title=f"Moves with {', '.join(one.name for one in named)}",
        cases=asked.cases(moves, asked.arms or (AS_DESCRIBED,)),
        methods=(*named, WaitingMethod(), *others),
        columns=(*COLUMNS, *MORE),
        few=FEW_COLUMNS,
        more=(*SUMMED, *(of("reduction_percent") for of in (lowest, highest))),
        finish=lambda result: _finish(result, notes),
        tables=_tables,
        draw=_draw,
        facts=asked.facts,
    )


def rows_of_first(result: Result) -> list[dict[str, Any]]:
    """Return the measured rows of the first shaper on the first arm."""
    first = result.values["summary"][0]["shaper"], next(iter(result.values["arms"]))
    mine = (pl.col("shaper") == first[0]) & (pl.col("arm") == first[1]) & (pl.col("status") == MEASURED)
    return result.rows.filter(mine).to_dicts()


def _finish(result: Result, notes: Sequence[str]) -> None:
    values, moves = result.values, rows_of_first(result)
    values["moves"] = result.rows.drop("error").to_dicts()
    first, *others = values["summary"]
    quiet = len(moves) - first["counted"]
    values["notes"] += notes
    if quiet:
        values["notes"].append(
            f"{quiet} of {len(moves)} moves have an unshaped peak below {WORTH:g} m/s²: the percentages leave them out"
        )
    if first["never_still"]:
        values["notes"].append(
            f"{first['never_still']} shaped moves were still above 0.1 m/s² at the end of the simulation"
        )
    values["verdict"] = _verdict(moves, first, [one for one in others if one["shaper"] != "waiting"])


def _verdict(
    moves: Sequence[Mapping[str, Any]], first: Mapping[str, Any], others: Sequence[Mapping[str, Any]]
) -> list[str]:
    name = first["shaper"]
    less = [move["reduction_percent"] for move in moves if move["reduction_percent"] is not None]
    if not less:
        return [f"No move vibrates enough unshaped to show what {name} does."]
    many = len(less) >= QUANTILES_FROM
    words, delays = ("less", "more"), [move["delay_ms"] for move in moves]
    worst = (
        f", {either([first['reduction_percent_p5']], '%', words)} in all but one of twenty," if many else ""
    )
    lead = (
        f"{name} leaves {either(less, '%', words)} vibration after the stop ({sample(len(less), 'move')})"
        f"{worst} and makes a move {spread(delays, 'ms')} longer."
    )
    figure, late = (
        ("reduction_percent_median", "delay_ms_median") if many else ("reduction_percent_min", "delay_ms_max")
    )
    better = [
        f"{one['shaper']} ({'' if many else 'at least '}{one[figure]:.0f} %, {one[late]:.0f} ms)"
        for one in others
        if one[figure] is not None and one[figure] > first[figure] and one[late] <= first[late]
    ]
    if better:
        return [lead, f"Better, and not later: {', '.join(better)}."]
    return [lead, "No baseline leaves less without being later."] if others else [lead]


def _tables(result: Result) -> Sequence[ResultTable]:
    each = ResultTable(
        f"moves with {result.values['summary'][0]['shaper']}", rows_of_first(result), EACH, listing=True
    )
    return [each, result.study.table_of(result.values["summary"])]


def _draw(result: Result) -> Figures:
    from tvist_lab.figures import residual_by_move_figure, vibration_figure

    moves = rows_of_first(result)
    if not moves:
        return {}
    middle = moves[example(moves)]["move"]
    caption = f"Move {middle}, the middle one by how much it vibrates unshaped."
    return {
        "moves": (residual_by_move_figure(moves), "Vibration after each move, unshaped and shaped."),
        "one_move": (vibration_figure(*record(next(result.study.jobs([middle - 1]))), middle), caption),
    }


def example(moves: Sequence[Mapping[str, Any]]) -> int:
    """Return the index of the move to draw: of median unshaped vibration, if possible among counted moves."""
    counted = [place for place, move in enumerate(moves) if move["reduction_percent"] is not None]
    counted = counted or list(range(len(moves)))
    return sorted(counted, key=lambda place: float(moves[place]["unshaped_peak_m_s2"]))[len(counted) // 2]


PRESET = Preset(
    study,
    shapers=("zv",),
    defaults="baselines",
    options=frozenset(("plants", "limits", "streams", "modes", "frequency_error", "payload_error", "stiffness_error")),
    modal=False,
)  # fmt: skip
