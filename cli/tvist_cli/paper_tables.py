"""Print the paper's tables beside those of this run."""

from typing import Any

from tvist_cli.output import number, out, table, words

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
METHOD_TERMS = {
    "peak": "largest true acceleration of the tool later than 10 ms after the end of the command; less: by how much",
    "still": "last time at which it exceeds 0.1 m/s²",
    "q̈/limit": "largest acceleration of a joint over its limit",
}


def print_paper(result: dict[str, Any]) -> None:
    """Print the results of `tvist demo`: the tables of each arm, and the origins of its figures."""
    from tvist_lab.studies.paper.report import MEANINGS, beside

    arms = [result, *result.get("others", ())]
    for one in arms:
        _print_arm(one)
    words({**TERMS, **METHOD_TERMS})
    headings, *rows = beside(arms)
    table("origin of each figure", headings, rows)
    words(MEANINGS)
    for note in dict.fromkeys(note for one in arms for note in one["notes"]):
        out.print(note)


def _print_arm(result: dict[str, Any]) -> None:
    from tvist_lab.studies.paper.published import published
    from tvist_lab.studies.paper.report import methods, table_2

    theirs, robot = published()["configurations"], result["robot"]
    table(
        f"{robot}: Table 1, lowest mode with 5 kg",
        ("pose", "f_d Hz, paper", "identified", "true", "ζ, paper", "identified", "true"),
        [_mode(name, theirs[name], row) for name, row in result["table_1"].items()],
    )
    runs = "one run" if result["runs"] == 1 else f"mean of {result['runs']} runs"
    table(
        f"{robot}: Table 2, {runs} beside the paper's 10",
        ("motion", "delay ms", "stabil. ms", "cycle ms", "overshoot m", "RV m/s²"),
        [(f"{motion} {what}", *figures) for motion, what, *figures in table_2(result["table_2"], 3)],
    )
    for motion in result["baselines"]:
        table(
            f"{robot}, {motion}: every method from the start of the unshaped reference (← still first)",
            ("method", "delay ms", "RV m/s²", "peak m/s²", "less %", "still ms", "q̈/limit"),
            methods(result, motion, "{} ←"),
        )


def _mode(name: str, paper: dict[str, Any], row: dict[str, float]) -> tuple[str, ...]:
    return (
        name,
        *(number(value, digits) for value, digits in (
            (paper["f_d_hz"], 1), (row["f_d_hz"], 2), (row.get("true_f_d_hz"), 2),
            (paper["zeta"], 2), (row["zeta"], 3), (row.get("true_zeta"), 3),
        )),
    )  # fmt: skip
