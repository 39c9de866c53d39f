"""Reports of `tvist evaluate` and `tvist shaperbench`, from what they print with `--json`."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.report.page import Page, PageTable, Section, picture
from tvist_lab.studies.evaluate import example
from tvist_lab.studies.leaderboard import IN_REPORT, ranked
from tvist_lab.study.measures import MEASURES
from tvist_lab.study.study import Study
from tvist_lab.study.tables import Shown, cells, titles
from tvist_lab.words import counted

LISTED = 200
"""Largest number of moves that are listed one by one."""
WAYS = (
    Shown("", "name"), Shown("less, median", "reduction_percent.median", 1, " %"),
    Shown("p5", "reduction_percent.p5", 1, " %"), Shown("least", "reduction_percent.min", 1, " %"),
    Shown("less than waiting", "less_than_waiting_percent.median", 1, " %"), Shown("delay ms", "delay_ms.median", 0),
    Shown("still ms", "still_after_unshaped_stop_ms.median", 0),
    Shown("largest q̈ / limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
MOVES = (
    Shown("move", "place"), Shown("payload kg", "payload_kg", 2), Shown("unshaped m/s²", "unshaped_peak_m_s2", 3),
    Shown("shaped m/s²", "shaped_peak_m_s2", 3), Shown("less", "reduction_percent", 1, " %"),
    Shown("delay ms", "delay_ms", 0), Shown("still ms", "still_after_ms.shaped", 0),
    Shown("q̈ / limit", "peak_acceleration_ratio", 3),
)  # fmt: skip


def evaluation_page(result: Mapping[str, Any], figures: Mapping[str, Figure], command: str) -> Page:
    """Build the report of an evaluation.

    Args:
        result: What `tvist evaluate --json` prints.
        figures: `moves` and `one_move`.
        command: The command that makes the report, for its provenance.
    """
    ways = {result["shaper"]: result, **result["baselines"]}
    rows = cells([{"name": name, **way} for name, way in ways.items()], WAYS)
    drawn = example(result["moves"]) + 1
    captions = {
        "moves": "Vibration after each move, unshaped and shaped.",
        "one_move": f"Move {drawn}, which vibrates like the median of all moves.",
    }
    sections = [Section("Shapers", tables=[PageTable(titles(WAYS), rows)]), _drawn(figures, captions)]
    sections.append(Section("Moves", tables=[_moves(result["moves"])]))
    if result["notes"]:
        sections.append(Section("Notes", points=result["notes"]))
    words = {
        "less": "Reduction of the largest acceleration of the tool, later than 10 ms after the reference stops.",
        "less than waiting": "The same against an unshaped arm that waits as long as the shaper is late.",
        "delay": "Time by which shaping lengthens a move, median.",
        "still": "Last time |α| exceeds 0.1 m/s², from the stop of the unshaped reference, median.",
        "p5": "The fifth percentile: 95 of 100 moves are better.",
    }
    facts = {
        "Command": command,
        "Arm": str(result["plant"]),
        "Calibration": str(result["calibration"]),
        "Limits": str(result["limits"]),
        "Seed": str(result["seed"]),
    }
    sections += [Section("What the words mean", facts=words), Section("Provenance", facts=facts)]
    return Page(f"Evaluation of the shaper {result['shaper']}", _verdict_on_evaluation(result), sections)


def _verdict_on_evaluation(result: Mapping[str, Any]) -> list[str]:
    name, less, delay = result["shaper"], result["reduction_percent"], result["delay_ms"]["median"]
    if less["median"] is None:
        return [f"No move vibrates enough unshaped to show what {name} does."]
    moves = counted(result["counted"], "move")
    if less["median"] <= 0.0:
        lead = f"{name} does not reduce the vibration of {moves}: the median is {-less['median']:.0f} % more."
    else:
        lead = (
            f"{name} leaves {less['median']:.0f} % less vibration after the stop (median of {moves}), "
            f"{less['p5']:.0f} % less in all but one of twenty, and makes a move {delay:.0f} ms longer."
        )
    better = [
        f"{other} ({way['reduction_percent']['median']:.0f} %, {way['delay_ms']['median']:.0f} ms)"
        for other, way in result["baselines"].items()
        if way["reduction_percent"]["median"] is not None
        and way["reduction_percent"]["median"] > less["median"]
        and way["delay_ms"]["median"] <= delay
    ]
    if not result["baselines"]:
        return [lead]
    if better:
        return [lead, f"Better, and not later: {', '.join(better)}."]
    return [lead, "No baseline leaves less without being later."]


def _moves(moves: Sequence[Mapping[str, Any]]) -> PageTable:
    numbered = [{"place": place, **move} for place, move in enumerate(moves[:LISTED], 1)]
    more = f"The first {LISTED} of {len(moves)} moves" if len(moves) > LISTED else ""
    return PageTable(titles(MOVES), cells(numbered, MOVES), more)


def shaperbench_page(result: Mapping[str, Any], figures: Mapping[str, Figure]) -> Page:
    """Build the report of a ranking of shapers.

    Args:
        result: What `tvist shaperbench --json` prints.
        figures: `pareto` and `settling_measured`.
    """
    entries = ranked(result)
    caption = "* keeps the limits, and no other shaper that keeps them is better in both still and vibration"
    shown = PageTable(titles(IN_REPORT), cells(entries, IN_REPORT), caption)
    captions = {
        "pareto": "Settling time against residual vibration.",
        "settling_measured": "Settling time against delay.",
    }
    sections = [Section("Shapers", tables=[shown]), _drawn(figures, captions)]
    if others := [f"{row['name']}: it {row['fault']}" for row in result["shapers"] if not row["ranked"]]:
        sections.append(Section("Not ranked", points=others))
    sections.append(Section("Arms", facts=result["arms"]))
    errors = ", ".join(f"{100 * error:+.0f} %" for error in result["payload_errors"])
    facts = {
        "Command": result["command"],
        "Moves": f"{result['moves']}, payload errors of {errors}",
        "Calibration": str(result["calibration"]),
        "Seed": str(result["seed"]),
    }
    sections.append(Section("Provenance", facts=facts))
    return Page(
        f"Ranking of {len(entries)} shapers", _verdict_on_ranking(entries, len(result["arms"])), sections
    )


def _verdict_on_ranking(ranked: Sequence[Mapping[str, Any]], arms: int) -> list[str]:
    still = [
        row for row in ranked if row["keeps_limits"] and row["time_until_still_ms"]["median"] is not None
    ]
    if not still:
        return ["No shaper that keeps the limits brings the arms to rest."]
    first = min(still, key=lambda row: row["time_until_still_ms"]["median"])
    quiet = min(still, key=lambda row: row["residual_m_s2"]["median"])
    still_at, less = first["time_until_still_ms"]["median"], first["reduction_percent"]["median"]
    lead = (
        f"Of those that keep the limits, {first['name']} is at rest first: {still_at:.0f} ms after the unshaped stop "
        f"(median over {arms} arms), with {less:.0f} % less vibration than waiting."
    )
    if quiet is first:
        return [lead, "It also leaves the least vibration."]
    return [lead, f"{quiet['name']} leaves the least vibration: {quiet['residual_m_s2']['median']:.3f} m/s²."]


def study_page(study: Study, result: Mapping[str, Any], figures: Mapping[str, Figure], command: str) -> Page:
    """Build the report of a study of one's own.

    Args:
        study: The study.
        result: What `tvist study FILE --json` prints.
        figures: `study`.
        command: The command that makes the report, for its provenance.
    """
    columns = study.shown(result["summary"])
    words = {
        name: f"{MEASURES[name].meaning}{f' [{MEASURES[name].unit}]' if MEASURES[name].unit else ''}"
        for name in study.show
    }
    sections = [
        Section("Results", tables=[PageTable(titles(columns), cells(result["summary"], columns))]),
        _drawn(figures, {"study": "Medians, and bands from the 5th to the 95th percentile."}),
        Section("What the words mean", facts=words),
        Section("Provenance", facts={"Command": command, "Rows": str(result["rows"])}),
    ]
    return Page(study.title, [study.notes or f"{counted(result['rows'], 'row')} were measured."], sections)


def _drawn(figures: Mapping[str, Figure], captions: Mapping[str, str]) -> Section:
    return Section(
        "Figures", pictures=[picture(figures[name], caption) for name, caption in captions.items()]
    )
