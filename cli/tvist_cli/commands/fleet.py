"""`tvist fleet`: the robots of a network, and how all of them stop."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from rich.live import Live
from rich.table import Table

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import number, out, print_json

if TYPE_CHECKING:
    from tvist_client.fleet import Fleet, FleetRobot, Place

EVERY = 1.0
"""Time between two looks of --watch [s]."""


def fleet(
    action: Literal["show", "stop"] = "show",
    *robots: str,
    everyone: Annotated[bool, Parameter(name="--all")] = False,
    endpoint: str = "tcp/127.0.0.1:7447",
    namespace: str = "",
    security: Path | None = None,
    watch: bool = False,
    json: bool = False,
) -> None:
    """Show the robots that a router or server reaches, with their modes and their health, or stop them.

    Robots are found by their liveliness tokens. With stop, each robot's answer is reported; the exit code is 1 if one
    did not answer or refused, and 0 if all have stopped.

    Args:
        action: show, or stop, which stops motions at once, whoever has control.
        robots: Robots to stop: NAME, or NAMESPACE/NAME.
        everyone: Stop all robots.
        endpoint: Zenoh endpoint of the router, or of a server.
        namespace: Only robots in this namespace or below it [all].
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        watch: Show the robots every second until Control+C.
        json: Print one JSON object; with --watch, one a second.
    """
    _check(action, robots, everyone=everyone, watch=watch)
    from tvist_client.fleet import Fleet, place_of

    with told(code=2):
        wanted = [place_of(robot) for robot in robots]

    async def run() -> None:
        async with Fleet(endpoint, security=security, namespace=namespace) as found:
            if action == "stop":
                await _stop(found, wanted, json=json)
            elif watch:
                await _watch(found, json=json)
            else:
                await found.listen()
                _show(await found.look(), endpoint, json=json)

    with told():
        try:
            asyncio.run(run())
        except KeyboardInterrupt:
            raise interrupted("the robots keep running") from None


def _check(action: str, robots: tuple[str, ...], *, everyone: bool, watch: bool) -> None:
    if action == "stop" and bool(robots) == everyone:
        raise Failure("fleet stop needs names of robots, or --all, but not both", code=2)
    if action == "show" and (robots or everyone):
        raise Failure("names of robots and --all are for fleet stop: leave them out", code=2)
    if action == "stop" and watch:
        raise Failure("--watch is not for fleet stop: leave it out", code=2)


async def _stop(found: "Fleet", wanted: "list[Place]", *, json: bool) -> None:
    places = wanted or list(found.places)
    if not places:
        raise Failure("there are no robots, so none was stopped")
    reports = await found.stop(places)
    if json:
        print_json({"robots": reports})
    for report in reports if not json else ():
        where = f"{report.namespace}/{report.name}" if report.namespace else report.name
        out.print(f"{where}: {report.said}", soft_wrap=True, markup=False)
    failed = [report for report in reports if not report.ok]
    if failed:
        raise Failure(f"{len(failed)} of {len(reports)} robots may still be moving: {failed[0].name} first")


async def _watch(found: "Fleet", *, json: bool) -> None:
    if json:
        while True:
            print_json({"robots": await found.look()})
            await asyncio.sleep(EVERY)
    with Live(console=out, auto_refresh=False) as live:
        while True:
            live.update(_table(await found.look()), refresh=True)
            await asyncio.sleep(EVERY)


def _show(robots: "list[FleetRobot]", endpoint: str, *, json: bool) -> None:
    if json:
        print_json({"robots": robots})
        return
    if not robots:
        out.print(f"there are no robots at {endpoint}", markup=False)
        return
    out.print(_table(robots))
    for robot in robots:
        if robot.said:
            out.print(f"{robot.name}: {robot.said}", soft_wrap=True, markup=False)


def _table(robots: "list[FleetRobot]") -> Table:
    drawn = Table(show_edge=False, pad_edge=False)
    for column in ("namespace", "robot", "model", "robot mode", "safety mode", "control"):
        drawn.add_column(column, no_wrap=column == "robot")
    for column in ("ticks/s", "silent s", "missed", "late p99 µs", "load %"):
        drawn.add_column(column, justify="right", no_wrap=column == "missed")
    for robot in robots:
        drawn.add_row(
            robot.namespace or "–",
            robot.name,
            robot.model or "no answer",
            robot.robot_mode or "–",
            robot.safety_mode or "–",
            robot.control or "–",
            number(robot.ticks_per_second, 1),
            number(robot.silent_s, 1),
            "–" if robot.due_ticks is None else f"{robot.missed_ticks} of {robot.due_ticks}",
            number(robot.late_p99_us, 0),
            number(None if robot.load is None else 100.0 * robot.load, 1),
            style="bold red" if robot.overloaded or not robot.ready else "",
        )
    return drawn
