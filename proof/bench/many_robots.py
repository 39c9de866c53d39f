"""Processor time of one of several served robots."""

import asyncio
from collections.abc import Callable

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_lab.bench.process import cpu_seconds
from tvist_lab.served import served
from tvist_protocol import keys

SEVERAL, SLOWER = 8, 0.25
"""Number of robots, and their speed relative to real time."""
SETTLE = 2.0
"""Time that is not measured at first [s]."""


async def us_per_robot_and_tick(seconds: float, tell: Callable[[str], None]) -> float:
    """Return the processor time of a process with `SEVERAL` robots, for each of their ticks [µs].

    A client reads every state of every robot. They run at a fraction of their speed, so that none is late.

    Args:
        seconds: How long it is measured [s].
        tell: Called with a description of each measurement before it starts.
    """
    tell(f"{SEVERAL} robots at speed {SLOWER:g} for {seconds:g} s")
    ticks = 0

    def count(_: zenoh.Sample) -> None:
        nonlocal ticks
        ticks += 1

    options = ["--robots", f"ur5e*{SEVERAL}", "--speed", str(SLOWER)]
    async with served(options, "ur5e-1", several=True) as server:
        session = await asyncio.to_thread(open_session, server.endpoint)
        session.declare_subscriber(f"{keys.PREFIX}/*/state", Callback(count, indirect=False))
        await asyncio.sleep(SETTLE)
        used, before = cpu_seconds(server.pid), ticks
        await asyncio.sleep(seconds)
        used, ticked = cpu_seconds(server.pid) - used, ticks - before
        await asyncio.to_thread(close_session, session)
    return 1e6 * used / max(1, ticked)
