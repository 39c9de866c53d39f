"""Studies of `tvist bench` that take minutes or need a load: each runs instead of the others, and prints its tables."""

import asyncio
from typing import Any

from tvist_cli.output import err, print_json, say, table


def hostile(pairs: int, seconds: float, json: bool) -> None:
    """Print what a flood of messages costs."""
    from tvist_lab.benchmark.hostile import hostile

    result = asyncio.run(hostile(pairs, seconds, tell=err.print))
    if json:
        print_json(result)
        return
    _pairs(result, f"{pairs} pairs of {seconds:g} s, {result['messages_per_second']:g} messages a second")


def _pairs(result: dict[str, Any], title: str) -> None:
    rows = [
        (what, *(f"{result[what][name]:.4g}" for name in ("without", "with", "difference", "interval")))
        for what in ("late_p99_us", "missed")
    ]
    table(title, ("a run", "without", "with", "difference", "± (95 %)"), rows)


def lateness(minutes: float, json: bool) -> None:
    """Print how many ticks a robot misses beside a bare thread."""
    from tvist_lab.benchmark.on_time import on_time

    result = asyncio.run(on_time(minutes, tell=say))
    if json:
        print_json(result)
        return
    for name, figures in result.items():
        rows = [(key, f"{value:.4g}") for key, value in figures.items()]
        table(f"missed ticks, {name.replace('_', ' ')}", ("what", "figure"), rows)


def soak(minutes: float, json: bool) -> None:
    """Print whether a robot under load stays stable."""
    from tvist_lab.benchmark.soak import soak

    say(
        f"serving a robot in real time for {minutes:g} minutes with a recorder, a set-point stream and five observers"
    )
    result = asyncio.run(soak(minutes, tell=say))
    if json:
        print_json(result)
        return
    table("soak", ("what", "figure"), [(key, f"{value:.6g}") for key, value in result.items()])
