"""The report of `tvist run`, from what it prints with `--json`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tvist_lab.report.page import Page, PageTable, Section
from tvist_lab.study.tables import Shown, cells, titles
from tvist_lab.words import counted

PROGRAMS = (
    Shown("program", "file"), Shown("result", "result"), Shown("time\ns", "seconds", 3), Shown("moves", "moves", 0),
    Shown("shake\nm/s²", "shake", 3), Shown("joint\nrad/s", "joint", 3), Shown("tool\nm/s", "tool", 3),
    Shown("warnings", "warnings", 0),
)  # fmt: skip
STOPS = (
    Shown("move", "number", 0), Shown("line", "line", 0), Shown("start\ns", "timestamp", 3),
    Shown("time\ns", "seconds", 3),
    Shown("next after\ns", "rested_s", 3), Shown("shake\nm/s²", "peak_after_stop_m_s2", 3),
)  # fmt: skip
WORDS = {
    "time": "Robot time of a program, or of a move until its shaped reference is at rest.",
    "shake": "Largest acceleration of the tool from 10 ms until 0.3 s after a stop, without gravity. Where the next "
    "move began within 0.1 s, it is what the tool would have done at rest.",
    "joint": "Largest speed of a joint, as measured.",
    "tool": "Largest speed of the tool centre point, as measured.",
    "next after": "How long the arm rested before the next move.",
}
LISTED = 500
"""Largest number of stops of a program that are listed."""


def programs_page(results: Sequence[Mapping[str, Any]], limits: Mapping[str, float], command: str) -> Page:
    """Build the report of the programs that a command ran.

    Args:
        results: What --json prints of each program.
        limits: Limits that were given, by their names.
        command: The command that makes the report, for its provenance.
    """
    failed = [result for result in results if not result["ok"]]
    count = counted(len(results), "program")
    verdict = f"{len(failed)} of {count} failed." if failed else f"{count} ran as {_they(results)} should."
    rows = cells([_row(result) for result in results], PROGRAMS)
    sections = [Section("Programs", tables=[PageTable(titles(PROGRAMS), rows)])]
    if failed:
        points = [_placed(result, one) for result in failed for one in result["failures"]]
        sections.append(Section("What failed", points=points))
    if tables := [_stops(result) for result in results if result.get("moves")]:
        sections.append(Section("Stops", tables=tables, points=list(_left_out(results))))
    if said := [_placed(result, one) for result in results for one in result.get("warnings", ())]:
        sections.append(Section("Warnings", points=said))
    facts = {"Command": command, **{_words(name): f"{value:g}" for name, value in limits.items()}}
    sections += [
        Section("What the words mean", facts=WORDS, explains=True),
        Section("This report", facts=facts),
    ]
    title = results[0]["file"] if len(results) == 1 else count
    return Page(f"Run of {title}", [verdict], sections)


def _words(name: str) -> str:
    """A name of --json or of an option in words."""
    return name.replace("_", " ")


def _they(results: Sequence[object]) -> str:
    return "it" if len(results) == 1 else "they"


def _row(result: Mapping[str, Any]) -> dict[str, Any]:
    kinds = dict.fromkeys(_words(one["kind"]) for one in result["failures"])
    row = {"file": result["file"], "result": ", ".join(kinds) or "ok"}
    if "moves" not in result:  # it did not compile
        return row | dict.fromkeys(("seconds", "moves", "shake", "joint", "tool", "warnings"))
    return row | {
        "seconds": result["seconds"],
        "moves": len(result["moves"]),
        "shake": result["largest_peak_after_stop_m_s2"],
        "joint": result["largest_joint_speed"]["speed_rad_s"],
        "tool": result["largest_tool_speed"]["speed_m_s"],
        "warnings": len(result["warnings"]),
    }


def _placed(result: Mapping[str, Any], said: Mapping[str, Any]) -> str:
    line = f", line {said['line']}" if said.get("line") else ""
    return f"{result['file']}{line}: {said['text']}"


def _stops(result: Mapping[str, Any]) -> PageTable:
    moves = [{**move, "number": number} for number, move in enumerate(result["moves"][:LISTED], 1)]
    return PageTable(titles(STOPS), cells(moves, STOPS), result["file"])


def _left_out(results: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for result in results:
        if (count := len(result.get("moves", ()))) > LISTED:
            yield f"{result['file']}: only the first {LISTED} of {count} stops are listed"
