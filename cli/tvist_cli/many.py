"""The screen of `tvist watch` with wildcards: one line for each robot."""

import asyncio
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.live import Live
from rich.table import Table

from tvist_cli.failure import told
from tvist_cli.output import out, print_json
from tvist_cli.watching import watch_for

if TYPE_CHECKING:
    from tvist_client.many_states import ManyStates

EVERY = 0.1
"""Time between two looks [s]."""
STALE_S = 1.0
"""Age of a newest state from which on it is shown in red [s]."""


def watch_many(
    selector: str,
    endpoint: str,
    namespace: str,
    security: Path | None,
    seconds: float | None,
    *,
    json: bool,
) -> None:
    """Show the newest states of all robots that a key selects, until Control+C.

    Args:
        selector: Key with wildcards that ends in `/state`.
        endpoint: Endpoint of a router, or of one server.
        namespace: Namespace that precedes the key.
        security: Folder with this client's certificate.
        seconds: Stop after this many seconds.
        json: Print one JSON object per line for each new state, ten times a second at most.
    """
    from tvist_client.errors import MisuseError
    from tvist_client.many_states import ManyStates

    with told(MisuseError, code=2):
        states = ManyStates(selector, endpoint, security=security, namespace=namespace)

    async def run() -> None:
        async with states:
            if json:
                await _print(states)
            with Live(console=out, auto_refresh=False) as live:
                since = time.monotonic()
                while True:
                    await asyncio.sleep(EVERY)
                    now, since = time.monotonic() - since, time.monotonic()
                    live.update(_table(states, now), refresh=True)

    watch_for(seconds, run(), "the robots keep running")


async def _print(states: "ManyStates") -> None:
    while True:
        await asyncio.sleep(EVERY)
        for place, newest in states.look().items():
            if newest.received:
                print_json({"namespace": place.namespace, "robot": place.robot, "state": newest.state})


def _table(states: "ManyStates", seconds: float) -> Table:
    from tvist_client.readiness import mode_name
    from tvist_protocol.modes import RobotMode, SafetyMode

    drawn = Table(show_edge=False, pad_edge=False)
    for column in ("robot", "robot mode", "safety mode"):
        drawn.add_column(column, no_wrap=True)
    for column in ("tick", "states/s", "age s", "missed", "fastest joint rad/s", "TCP x, y, z m"):
        drawn.add_column(column, justify="right")
    now = asyncio.get_running_loop().time()
    for place, (state, received, at) in states.look().items():
        drawn.add_row(
            str(place),
            mode_name(RobotMode, state.robot_mode),
            mode_name(SafetyMode, state.safety_mode),
            str(state.tick),
            f"{received / seconds:.0f}",
            f"{now - at:.1f}",
            str(state.missed_ticks),
            f"{max(map(abs, state.actual_qd)):.3f}",
            ", ".join(f"{value:.3f}" for value in state.actual_TCP_pose[:3]),
            style="bold red" if now - at > STALE_S else "",
        )
    return drawn
