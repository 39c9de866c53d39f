"""Tables of `tvist evaluate`."""

from typing import Any

from tvist_cli.output import number, out, say, table

LISTED = 12
"""Largest number of moves that are printed one by one."""


def print_evaluation(result: dict[str, Any]) -> None:
    """Print what `tvist_lab.studies.evaluate.report` found, and its notes."""
    from tvist_lab.studies.evaluate import MOVES, WAYS
    from tvist_lab.study.tables import cells, titles

    if len(result["moves"]) <= LISTED:
        moves = [{"place": place, **move} for place, move in enumerate(result["moves"], 1)]
        table(f"moves with shaper {result['shaper']}", titles(MOVES), cells(moves, MOVES))
    ways = {result["shaper"]: result, **result["baselines"]}
    rows = cells([{"name": name, **way} for name, way in ways.items()], WAYS)
    table(f"{result['counted']} moves, arm {result['plant']}", titles(WAYS), rows)
    median, p5 = (result["reduction_percent_interval"][name] for name in ("median", "p5"))
    if median is not None:
        out.print(
            f"95 % intervals (bootstrap): median {median[0]:.1f} to {median[1]:.1f} %, p5 {p5[0]:.1f} to {p5[1]:.1f} %"
        )
    peaks = [(name, way["peak_m_s2"]) for name, way in list(ways.items())[:2]]
    if median is not None:
        said = (f"{name} {number(peak['median'])} (p95 {number(peak['p95'])})" for name, peak in peaks)
        out.print(f"peaks in m/s², median: {', '.join(said)}")
    quiet = ", ".join(
        f"{name} {number(way['quiet_after_unshaped_stop_ms']['median'], 0)}" for name, way in ways.items()
    )
    out.print(f"still at 0.02 m/s² after, in ms, median: {quiet}")
    out.print("¹ last time |α| exceeds 0.1 m/s², median, from the stop of the unshaped reference")
    out.print("² less than an unshaped arm that waits equally long still vibrates")
    for note in result["notes"]:
        say(note)
