"""A live table of all robots that a router or server reaches: how they are, and what keeps them from being moved."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tvist_cli.output import number, out, print_json

if TYPE_CHECKING:
    from tvist_client.fleet import FleetRobot

EVERY = 1.0
"""Time between two looks [s]."""


async def watch_fleet(endpoint: str, namespace: str, security: Path | None, *, json: bool) -> None:
    """Show the robots every second, for ever.

    Args:
        endpoint: Endpoint of a router, or of one server.
        namespace: Namespace that the robots are in or below; empty: all.
        security: Folder with this client's certificate.
        json: Print one JSON object a second instead.
    """
    from tvist_client.fleet import Fleet

    async with Fleet(endpoint, security=security, namespace=namespace) as fleet:
        await fleet.listen()
        if json:
            while True:
                print_json({"robots": await fleet.look()})
                await asyncio.sleep(EVERY)
        with Live(console=out, auto_refresh=False) as live:
            while True:
                live.update(_screen(await fleet.look(), endpoint), refresh=True)
                await asyncio.sleep(EVERY)


def _screen(robots: "list[FleetRobot]", endpoint: str) -> Group:
    if not robots:
        return Group(Text(f"there are no robots at {endpoint}"))
    said = (Text(f"{robot.name}: {robot.said}") for robot in robots if robot.said)
    return Group(_table(robots), *said)


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
