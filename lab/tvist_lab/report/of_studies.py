"""Reports of `tvist evaluate` and `tvist shaperbench`, from what they print with `--json`."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.report.page import Page, PageTable, Section, picture
from tvist_lab.report.verdict import LESS
from tvist_lab.studies.evaluate import example
from tvist_lab.studies.leaderboard import IN_REPORT, ranked
from tvist_lab.study.measures import MEASURES
from tvist_lab.study.study import Study
from tvist_lab.study.tables import Shown, cells, titles
from tvist_lab.words import MANY, counted, either, sample, spread

LISTED = 200
"""Largest number of moves that are listed one by one."""
_DRIVEN = Shown("largest q̈\nof its limit", "peak_acceleration_ratio.max", 3)
WAYS = (
    Shown("", "name"), Shown("less\nmedian %", "reduction_percent.median", 1),
    Shown("less\np5 %", "reduction_percent.p5", 1), Shown("less\nleast %", "reduction_percent.min", 1),
    Shown("less than waiting\nmedian %", "less_than_waiting_percent.median", 1),
    Shown("delay\nmedian ms", "delay_ms.median", 0),
    Shown("still\nmedian ms", "still_after_unshaped_stop_ms.median", 0), _DRIVEN,
)  # fmt: skip
OF_FEW = (
    Shown("", "name"), Shown("less\nleast %", "reduction_percent.min", 1),
    Shown("less than waiting\nleast %", "less_than_waiting_percent.min", 1),
    Shown("delay\nlongest ms", "delay_ms.max", 0),
    Shown("still\nlatest ms", "still_after_unshaped_stop_ms.max", 0), _DRIVEN,
)  # fmt: skip
"""The same of fewer moves than a median needs."""
MOVES = (
    Shown("move", "place"), Shown("payload\nkg", "payload_kg", 2), Shown("unshaped\nm/s²", "unshaped_peak_m_s2", 3),
    Shown("shaped\nm/s²", "shaped_peak_m_s2", 3), Shown("less\n%", "reduction_percent", 1),
    Shown("delay\nms", "delay_ms", 0), Shown("still\nms", "still_after_ms.shaped", 0),
    Shown("largest q̈\nof its limit", "peak_acceleration_ratio", 3),
)  # fmt: skip
WORDS = {
    "less": "Reduction of the largest acceleration of the tool, later than 10 ms after the reference stops.",
    "less than waiting": "The same against an unshaped arm that waits as long as the shaper is late.",
    "delay": "Time by which shaping lengthens a move.",
    "still": "Last time |α| exceeds 0.1 m/s², from the unshaped reference's stop; of a single move, from its start.",
    "largest q̈": "Largest acceleration of a joint.",
}
P5 = "The fifth percentile: 95 of 100 moves are better."


def evaluation_page(result: Mapping[str, Any], figures: Mapping[str, Figure], command: str) -> Page:
    """Build the report of an evaluation.

    Args:
        result: What `tvist evaluate --json` prints.
        figures: `moves` and `one_move`.
        command: The command that makes the report, for its provenance.
    """
    ways = {result["shaper"]: result, **result["baselines"]}
    many = result["counted"] >= MANY
    columns = WAYS if many else OF_FEW
    rows = cells([{"name": name, **way} for name, way in ways.items()], columns)
    drawn = example(result["moves"]) + 1
    captions = {
        "moves": "Vibration after each move, unshaped and shaped.",
        "one_move": f"Move {drawn}, the middle one by how much it vibrates unshaped.",
    }
    sections = [Section("Shapers", tables=[PageTable(titles(columns), rows)]), _drawn(figures, captions)]
    sections.append(Section("Moves", tables=[_moves(result["moves"])]))
    if result["notes"]:
        sections.append(Section("Notes", points=result["notes"]))
    words = WORDS | ({"p5": P5} if many else {})
    facts = {
        "Command": command,
        "Arm": str(result["plant"]),
        "Calibration": str(result["calibration"]),
        "Limits": str(result["limits"]),
        "Seed": str(result["seed"]),
    }
    words_mean = Section("What the words mean", facts=words, explains=True)
    sections += [words_mean, Section("Provenance", facts=facts)]
    return Page(f"Evaluation of the shaper {result['shaper']}", _verdict_on_evaluation(result), sections)


def _verdict_on_evaluation(result: Mapping[str, Any]) -> list[str]:
    name = result["shaper"]
    less = [move["reduction_percent"] for move in result["moves"] if move["reduction_percent"] is not None]
    if not less:
        return [f"No move vibrates enough unshaped to show what {name} does."]
    many = len(less) >= MANY
    delays = [move["delay_ms"] for move in result["moves"]]
    p5 = result["reduction_percent"]["p5"]
    worst = f", {either([p5], '%', LESS)} in all but one of twenty," if many else ""
    lead = (
        f"{name} leaves {either(less, '%', LESS)} vibration after the stop ({sample(len(less), 'move')})"
        f"{worst} and makes a move {spread(delays, 'ms')} longer."
    )
    share, late = ("median", "median") if many else ("min", "max")
    mine = result["reduction_percent"][share], result["delay_ms"][late]
    ways = {
        other: (way["reduction_percent"][share], way["delay_ms"][late])
        for other, way in result["baselines"].items()
        if way["reduction_percent"][share] is not None
    }
    least = "" if many else "at least "
    better = [
        f"{other} ({least}{its_less:.0f} %, {its_delay:.0f} ms)"
        for other, (its_less, its_delay) in ways.items()
        if its_less > mine[0] and its_delay <= mine[1]
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
    made = result["moves"] * len(result["arms"]) * len(result["payload_errors"])
    columns = [one for one in IN_REPORT if made >= MANY or "\np" not in one.title]
    caption = "* keeps the limits, and no other shaper that keeps them is better in both still and vibration"
    shown = PageTable(titles(columns), cells(entries, columns), caption)
    captions = {
        "pareto": "Settling time against residual vibration.",
        "settling_measured": "Settling time against delay.",
    }
    sections = [Section("Shapers", tables=[shown]), _drawn(figures, captions)]
    if others := [f"{row['name']}: it {row['fault']}" for row in result["shapers"] if not row["ranked"]]:
        sections.append(Section("Not ranked", points=others))
    residual = {"vibration": "Envelope of the acceleration within 3 to 60 Hz after the shaped stop."}
    sections.append(Section("What the words mean", facts=WORDS | residual, explains=True))
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
        result: What `tvist study FILE --json` prints; of few rows, with a summary by their `ENDS`.
        figures: `study`.
        command: The command that makes the report, for its provenance.
    """
    entries = result["summary"]
    columns = study.shown(entries)
    words = {
        name: f"{MEASURES[name].meaning}{f' [{MEASURES[name].unit}]' if MEASURES[name].unit else ''}"
        for name in study.show
    }
    few = "least" in entries[0][study.show[0]]
    caption = (
        f"The least and the most of {spread([entry['rows'] for entry in entries], 'rows')} each."
        if few
        else "Medians, and bands from the 5th to the 95th percentile."
    )
    sections = [
        Section("Results", tables=[PageTable(titles(columns), cells(entries, columns))]),
        _drawn(figures, {"study": caption}),
        Section("What the words mean", facts=words, explains=True),
        Section("Provenance", facts={"Command": command, "Rows": str(result["rows"])}),
    ]
    return Page(study.title, [study.notes or f"{counted(result['rows'], 'row')} were measured."], sections)


def _drawn(figures: Mapping[str, Figure], captions: Mapping[str, str]) -> Section:
    return Section(
        "Figures", pictures=[picture(figures[name], caption) for name, caption in captions.items()]
    )
