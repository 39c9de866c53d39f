"""Several served robots: the processor time of one of them, and the memory that each further one takes."""

import asyncio
from collections.abc import Callable
from typing import Any

import psutil
import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_lab.bench.one_robot import cpu_seconds
from tvist_lab.served import served
from tvist_protocol import keys

SEVERAL, SLOWER = 8, 0.25
"""Number of robots, and their speed relative to real time."""
SETTLE = 2.0
"""Time that is not measured at first [s]."""
FEW, MORE, MANY = 1, 5, 20
"""Numbers of robots."""
SLOW = "0.05"
"""Speed of the simulation: its robots have all that those in real time have, and leave the machine free."""


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


async def memory(_: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure the memory of servers of 1, 5 and 20 robots, and of one of 20 robots in two processes.

    Args:
        tell: Called with a description of each measurement before it starts.

    Returns:
        Memory that no other process shares, with the proportional part of what is shared [MB], and the difference for
        each further robot.
    """
    few, more, many = [await _pss_mb(number, 1, tell) for number in (FEW, MORE, MANY)]
    spread = await _pss_mb(MANY, 2, tell)
    found = {
        "one_robot_mb": few,
        "further_robot_of_5_mb": (more - few) / (MORE - FEW),
        "further_robot_of_20_mb": (many - few) / (MANY - FEW),
        "robot_of_20_in_two_processes_mb": (spread - few) / (MANY - FEW),
    }
    return {"memory": found}


async def _pss_mb(robots: int, workers: int, tell: Callable[[str], None]) -> float:
    tell(f"memory of {robots} robots in {'one process' if workers == 1 else f'{workers} processes'}")
    options = ["--robots", f"ur5e*{robots}", "--workers", str(workers), "--speed", SLOW]
    name = "ur5e" if robots == 1 else f"ur5e-{robots}"
    async with served(options, name, several=True) as server:
        await server.robot.state()
        first = psutil.Process(server.pid)
        processes = [first, *first.children(recursive=True)]
        return sum(float(process.memory_full_info().pss) for process in processes) / 1e6
