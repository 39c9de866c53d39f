"""Studies of `tvist bench` that take minutes or need a load: each runs instead of the others, and prints its tables."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from tvist_cli.failure import told
from tvist_cli.figure_files import FigureOptions, write
from tvist_cli.output import err, number, print_json, say, table, typed


def boxes(
    shapers: Sequence[str], markdown: Path | None, figures: Path | None, look: FigureOptions, json: bool
) -> None:
    """Print where a tick's time goes."""
    from tvist_lab.benchmark.box_timer import BoxError
    from tvist_lab.benchmark.profile_page import COLUMNS, SUMMARY, page, rows, summary
    from tvist_lab.benchmark.tick_profile import tick_profile
    from tvist_server.config import ConfigError

    with told(ConfigError, code=2), told(BoxError):
        found = tick_profile(shapers, tell=lambda what: err.print(f"measuring {what} ..."))
    with told(OSError):
        if markdown is not None:
            markdown.write_text(page(found, typed()), encoding="utf-8")
        if figures is not None:
            from tvist_lab.benchmark.profile_page import FIGURE
            from tvist_lab.figures import tick_figure

            ticks = {name: {box.name: box.us for box in tick.boxes} for name, tick in found.ticks.items()}
            within = {box.name: box.within for tick in found.ticks.values() for box in tick.boxes}
            write(look.into(figures), {FIGURE: tick_figure(ticks, within)})
    if json:
        print_json(msgspec.to_builtins(found))
        return
    for name, tick in found.ticks.items():
        table(name, COLUMNS, rows(tick, "  "))
    table("beside MuJoCo", SUMMARY, [summary(name, tick) for name, tick in found.ticks.items()])


def hostile(pairs: int, seconds: float, json: bool) -> None:
    """Print what a flood of messages costs."""
    from tvist_lab.benchmark.hostile import hostile

    result = asyncio.run(hostile(pairs, seconds, tell=err.print))
    if json:
        print_json(result)
        return
    _pairs(result, f"{pairs} pairs of {seconds:g} s, {result['messages_per_second']:g} messages a second")


def viewed(pairs: int, seconds: float, json: bool) -> None:
    """Print what a page of `tvist view` costs."""
    from tvist_lab.benchmark.viewed import viewed

    result = asyncio.run(viewed(pairs, seconds, tell=err.print))
    if json:
        print_json(result)
        return
    _pairs(result, f"{pairs} pairs of {seconds:g} s, without and with a page")
    figures = {key: value for key, value in result.items() if not isinstance(value, dict)}
    table("the page", ("what", "figure"), [(key, f"{value:.4g}") for key, value in figures.items()])


def fleet(count: int, seconds: float, json: bool) -> None:
    """Print what routers carry."""
    from tvist_lab.benchmark.fleet import FleetError
    from tvist_lab.benchmark.fleet import fleet as run

    with told(FleetError):
        result = run(count, seconds, tell=say)
    if json:
        print_json(result)
        return
    flat = {key: value for key, value in result.items() if isinstance(value, float | int)}
    table(
        f"{count} publishers, two routers",
        ("what", "figure"),
        [(key, f"{value:.4g}") for key, value in flat.items()],
    )
    rates = result["rates"]
    unwatched = [(f"unwatched {key}", f"{value:.4g}") for key, value in result["unwatched"].items()]
    table("nobody subscribes", ("what", "figure"), unwatched)
    table(
        "everything is watched",
        ("what", *(f"{each['rate_hz']:g} Hz each" for each in rates)),
        [(key, *(number(each[key], 4) for each in rates)) for key in rates[0] if key != "rate_hz"],
    )


def reverse(seconds: float, json: bool) -> None:
    """Print how a program over a socket keeps up."""
    from tvist_lab.benchmark.reverse import reverse

    result = asyncio.run(reverse(seconds, tell=say))
    if json:
        print_json(result)
        return
    rows = [(key, f"{value:.6g}") for key, value in result.items()]
    table("a program steered over a socket", ("what", "figure"), rows)


def reading(minutes: float, json: bool) -> None:
    """Print how fast a recording is read."""
    from tvist_lab.benchmark.reading import reading

    result = asyncio.run(reading(minutes, tell=say))
    if json:
        print_json(result)
        return
    flat = {key: value for key, value in result.items() if not isinstance(value, dict)}
    table(
        f"a recording of {minutes:g} min",
        ("what", "figure"),
        [(key, f"{value:.6g}") for key, value in flat.items()],
    )
    formats = {key: value for key, value in result.items() if isinstance(value, dict)}
    rows = [(key, *(f"{figure:.4g}" for figure in value.values())) for key, value in formats.items()]
    table("export", ("format", "write s", "read s", "bytes", "equal"), rows)


def fixture(tests: int, json: bool) -> None:
    """Print how long the fixture takes."""
    from tvist_lab.benchmark.fixture import fixture

    result = fixture(tests, tell=say)
    if json:
        print_json(result)
        return
    rows = [(key, f"{value:.4g}") for key, value in result.items()]
    table(f"the fixture tvist_robot in sessions of {tests} tests", ("what", "figure"), rows)


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
