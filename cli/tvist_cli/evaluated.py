"""Tables of `tvist evaluate`."""

from typing import Any

from tvist_cli.output import number, out, say, table

LISTED = 12
"""Largest number of moves that are printed one by one."""


def print_evaluation(result: dict[str, Any]) -> None:
    """Print what `tvist_lab.evaluation.evaluate.report` found, and its notes."""
    if len(result["moves"]) <= LISTED:
        table(
            f"moves with shaper {result['shaper']}",
            (
                "move",
                "kg",
                "unshaped m/s²",
                "shaped m/s²",
                "less %",
                "delay ms",
                "still ms",
                "q̈/limit",
                "q̇/limit",
            ),
            [_row(place, move) for place, move in enumerate(result["moves"], 1)],
        )
    ways = {result["shaper"]: result, **result["baselines"]}
    table(
        f"{result['counted']} moves, arm {result['plant']}",
        (
            "",
            "less % median",
            "p5",
            "min",
            "than waiting² %",
            "p5",
            "delay ms",
            "still¹ ms",
            "p90",
            "q̈/limit",
            "max",
            "q̇ max",
        ),
        [_way(name, way) for name, way in ways.items()],
    )
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


def _row(place: int, move: dict[str, Any]) -> tuple[str, ...]:
    return (
        str(place), number(move["payload_kg"], 2), number(move["unshaped_peak_m_s2"]), number(move["shaped_peak_m_s2"]),
        number(move["reduction_percent"], 1), number(move["delay_ms"], 0), number(move["still_after_ms"]["shaped"], 0),
        number(move["peak_acceleration_ratio"]), number(move["peak_velocity_ratio"]),
    )  # fmt: skip


def _way(name: str, way: dict[str, Any]) -> tuple[str, ...]:
    keys = ("reduction_percent", "less_than_waiting_percent", "delay_ms", "still_after_unshaped_stop_ms")
    less, waiting, delay, still = (way[key] for key in keys)
    qdd = way["peak_acceleration_ratio"]
    return (
        name, *(number(less[key], 1) for key in ("median", "p5", "min")),
        *(number(waiting[key], 1) for key in ("median", "p5")), number(delay["median"], 0),
        *(number(still[key], 0) for key in ("median", "p90")), *(number(qdd[key]) for key in ("median", "max")),
        number(way["peak_velocity_ratio"]["max"]),
    )  # fmt: skip
