"""`tvist bench`: measure how fast tvist runs on this machine."""

import asyncio
from collections.abc import Callable
from typing import Any

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import err, number, out, print_json, say, table

MOST = 2000
"""Largest number of simulated publishers of a fleet."""


def bench(
    *,
    seconds: float = 10.0,
    soak: float | None = None,
    hostile: int | None = None,
    viewed: int | None = None,
    reverse: float | None = None,
    reading: float | None = None,
    fleet: int | None = None,
    fixture: int | None = None,
    lateness: float | None = None,
    json: bool = False,
) -> None:
    """Measure the plant, the filter, the whole control cycle, a served robot, and how many robots one core can run.

    Args:
        seconds: Seconds to observe a served robot in real time, with one client and a recorder; 0 skips this part.
        soak: Serve a robot under load for this many minutes instead, and report whether memory and timing stay stable.
        hostile: Instead, compare how late a served robot's ticks are with and without 100 messages a second of every
            type and size, valid and invalid, in this many pairs of runs of --seconds each.
        viewed: Instead, compare how late a served robot's ticks are with and without a page of tvist view, in this
            many pairs of runs of --seconds each, and report the page's pictures per second and its memory.
        reverse: Instead, for this many seconds, let a client steer the program of a served robot over a socket at
            500 Hz, as a driver does, and count the program's time-outs; two bare processes do the same meanwhile.
        reading: Instead, record a moving robot for this many minutes of simulation, and compare how long this recording
            takes to read with how long the bare MCAP reader takes; also export it to every format.
        fleet: Instead, connect this many simulated publishers to two routers, let a client see all their states at
            several rates for --seconds each, and report what the routers need, how late states are, and how long the
            fleet needs to be found and to come back after a router was killed.
        fixture: Instead, compare how long the pytest fixture tvist_robot takes, in sessions of this many tests, with
            how long tvist serve takes to start.
        lateness: Instead, compare the ticks that a served robot misses with those that a bare thread misses which
            sleeps to the same deadlines, in turn: for this many minutes alone, as many with ten clients, and as many
            with ten clients, real-time priority and locked memory.
        json: Print one JSON object.
    """
    _check(
        seconds,
        {"soak": soak, "reverse": reverse, "reading": reading, "lateness": lateness},
        {"hostile": hostile, "viewed": viewed},
    )
    if fixture is not None and fixture < 2:
        raise Failure(f"fixture is {fixture}: must be at least 2 tests", code=2)
    if fleet is not None and not (2 <= fleet <= MOST and seconds > 0.0):
        raise Failure(f"fleet is {fleet}: must be 2 to {MOST} publishers, and seconds more than 0", code=2)
    studies: tuple[tuple[float | None, Callable[[], None]], ...] = (
        (fleet, lambda: _fleet(fleet or 0, seconds, json)),
        (hostile, lambda: _hostile(hostile or 0, seconds, json)),
        (viewed, lambda: _viewed(viewed or 0, seconds, json)),
        (reverse, lambda: _reverse(reverse or 0.0, json)),
        (reading, lambda: _reading(reading or 0.0, json)),
        (fixture, lambda: _fixture(fixture or 0, json)),
        (lateness, lambda: _lateness(lateness or 0.0, json)),
        (soak, lambda: _soak(soak or 0.0, json)),
        (0.0, lambda: _all(seconds, json)),
    )
    try:
        next(study for asked, study in studies if asked is not None)()
    except KeyboardInterrupt:
        raise interrupted("the measurements so far are lost; the served robots have stopped") from None


def _check(seconds: float, durations: dict[str, float | None], runs: dict[str, int | None]) -> None:
    if seconds < 0.0:
        raise Failure(f"seconds is {seconds:g}: must be at least 0", code=2)
    for name, duration in durations.items():
        if duration is not None and not duration > 0.0:
            raise Failure(f"{name} is {duration:g}: must be more than 0", code=2)
    for name, pairs in runs.items():
        if pairs is not None and not (pairs >= 2 and seconds > 0.0):
            raise Failure(
                f"{name} is {pairs}: must be at least 2 pairs of runs, of more than 0 seconds", code=2
            )


def _all(seconds: float, json: bool) -> None:
    from tvist_lab.bench import bench as run

    result = run(seconds, tell=lambda what: err.print(f"measuring {what} ..."))
    if json:
        print_json(result)
        return
    flat = {key: value for key, value in result.items() if not isinstance(value, dict)}
    table("on this machine", ("what", "figure"), [(key, f"{value:.4g}") for key, value in flat.items()])
    for key, values in result.items():
        if isinstance(values, dict):
            table(key, ("what", "figure"), [(name, f"{value:.4g}") for name, value in values.items()])
    out.print("These figures hold for this machine under its current load; compare ratios, not microseconds.")


def _hostile(pairs: int, seconds: float, json: bool) -> None:
    from tvist_lab.benchmark.hostile import hostile

    result = asyncio.run(hostile(pairs, seconds, tell=err.print))
    if json:
        print_json(result)
        return
    _pairs(result, f"{pairs} pairs of {seconds:g} s, {result['messages_per_second']:g} messages a second")


def _viewed(pairs: int, seconds: float, json: bool) -> None:
    from tvist_lab.benchmark.viewed import viewed

    result = asyncio.run(viewed(pairs, seconds, tell=err.print))
    if json:
        print_json(result)
        return
    _pairs(result, f"{pairs} pairs of {seconds:g} s, without and with a page")
    figures = {key: value for key, value in result.items() if not isinstance(value, dict)}
    table("the page", ("what", "figure"), [(key, f"{value:.4g}") for key, value in figures.items()])


def _fleet(count: int, seconds: float, json: bool) -> None:
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


def _reverse(seconds: float, json: bool) -> None:
    from tvist_lab.benchmark.reverse import reverse

    result = asyncio.run(reverse(seconds, tell=say))
    if json:
        print_json(result)
        return
    rows = [(key, f"{value:.6g}") for key, value in result.items()]
    table("a program steered over a socket", ("what", "figure"), rows)


def _reading(minutes: float, json: bool) -> None:
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


def _fixture(tests: int, json: bool) -> None:
    from tvist_lab.benchmark.fixture import fixture

    result = fixture(tests, tell=say)
    if json:
        print_json(result)
        return
    rows = [(key, f"{value:.4g}") for key, value in result.items()]
    table(f"the fixture tvist_robot in sessions of {tests} tests", ("what", "figure"), rows)


def _lateness(minutes: float, json: bool) -> None:
    from tvist_lab.benchmark.on_time import on_time

    result = asyncio.run(on_time(minutes, tell=say))
    if json:
        print_json(result)
        return
    for name, figures in result.items():
        rows = [(key, f"{value:.4g}") for key, value in figures.items()]
        table(f"missed ticks, {name.replace('_', ' ')}", ("what", "figure"), rows)


def _pairs(result: dict[str, Any], title: str) -> None:
    rows = [
        (what, *(f"{result[what][name]:.4g}" for name in ("without", "with", "difference", "interval")))
        for what in ("late_p99_us", "missed")
    ]
    table(title, ("a run", "without", "with", "difference", "± (95 %)"), rows)


def _soak(minutes: float, json: bool) -> None:
    from tvist_lab.benchmark.soak import soak

    say(
        f"serving a robot in real time for {minutes:g} minutes with a recorder, a set-point stream and five observers"
    )
    result = asyncio.run(soak(minutes, tell=say))
    if json:
        print_json(result)
        return
    table("soak", ("what", "figure"), [(key, f"{value:.6g}") for key, value in result.items()])
