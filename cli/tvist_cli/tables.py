"""Print the paper's tables beside ours."""

from typing import Any

from tvist_cli.output import number, out, table, words

COLUMNS = ("delay_ms", "stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2")

TERMS = {
    "f_d, ζ": "frequency at which the arm vibrates, and its damping ratio: 0 rings for ever, 1 does not swing back",
    "shaped": "the command is split into two, half a period of the vibration apart, so that their vibrations cancel",
    "delay": "how much longer the shaped command takes",
    "stabil.": "time from the tool's first coming within 0.03 mm of where it ends to its staying there",
    "cycle": "time from the start of the motion until the tool stays there",
    "overshoot": "how far the tool leaves that place again in between",
    "RV": "residual vibration: acceleration with which the tool vibrates at the end of the command",
    "impact": "change by shaping",
}
"""Words of Tables 1 and 2."""
METHOD_TERMS = {
    "peak": "largest true acceleration of the tool later than 10 ms after the end of the command; less: by how much",
    "still": "last time at which it exceeds 0.1 m/s²",
    "q̈/limit": "largest acceleration of a joint over its limit",
}
"""Words of the tables of methods."""


def print_paper(result: dict[str, Any]) -> None:
    """Print the results of `tvist paper` and `tvist demo`."""
    from tvist_lab.studies.paper.published import published

    theirs = published()
    table(
        "Table 1, lowest mode with 5 kg",
        ("pose", "f_d Hz, paper", "identified", "true", "ζ, paper", "identified", "true"),
        [_mode(name, theirs["configurations"][name], row) for name, row in result["table_1"].items()],
    )
    rows = []
    for motion, ours in result["table_2"].items():
        for kind in ("unshaped", "shaped"):
            for who, source in (("paper", theirs["table_2"][motion]), ("here", ours)):
                rows.append((f"{motion} {kind}, {who}", *_figures(source[kind])))
        for who, source in (("paper", theirs["table_2"][motion]), ("here", ours)):
            impact = source["impact_percent"]
            percents = (f"{impact[key]:+.1f} %" if impact[key] is not None else "–" for key in impact)
            rows.append((f"{motion} impact, {who}", "", *percents))
    table(
        f"Table 2, {_runs(result['runs'])} beside the paper's 10",
        ("motion", "delay ms", "stabil. ms", "cycle ms", "overshoot m", "RV m/s²"),
        rows,
    )
    words(TERMS)
    for motion, methods in result["baselines"].items():
        first = min(
            (row["still_after_ms"] for row in methods.values() if row["still_after_ms"] is not None),
            default=None,
        )
        table(
            f"{motion}: every method from the start of the unshaped reference (← still first)",
            ("method", "delay ms", "RV m/s²", "peak m/s²", "less %", "still ms", "q̈/limit"),
            [
                (
                    _label(result, name) + (" ←" if row["still_after_ms"] == first else ""),
                    number(row["delay_ms"], 0), number(row["residual_vibration_m_s2"]), number(row["peak_m_s2"]),
                    number(row["peak_reduction_percent"], 1), number(row["still_after_ms"], 0),
                    number(row["peak_acceleration_ratio"]),
                )
                for name, row in methods.items()
            ],
        )  # fmt: skip
    words(METHOD_TERMS)
    for note in result["notes"]:
        out.print(note)
    if result["notes"]:
        out.print()


def _mode(name: str, paper: dict[str, Any], row: dict[str, float]) -> tuple[str, ...]:
    return (
        name,
        number(paper["f_d_hz"], 1),
        number(row["f_d_hz"], 2),
        number(row.get("true_f_d_hz"), 2),
        number(paper["zeta"], 2),
        number(row["zeta"]),
        number(row.get("true_zeta")),
    )


def _figures(row: dict[str, float | None]) -> tuple[str, ...]:
    overshoot = row["overshoot_m"]
    return (
        number(row["delay_ms"], 1),
        number(row["stabilisation_ms"], 1),
        number(row["cycle_ms"], 1),
        "–" if overshoot is None else f"{overshoot:.1e}",
        number(row["residual_vibration_m_s2"]),
    )


def _label(result: dict[str, Any], name: str) -> str:
    return "waiting, unshaped" if name == "unshaped" else str(result["methods"][name])


def _runs(runs: int) -> str:
    return "one run" if runs == 1 else f"mean of {runs} runs"
