"""Memory that each further robot of a server takes."""

import asyncio
from collections.abc import Callable
from typing import Any

import psutil

from tvist_lab.served import served

FEW, MORE, MANY = 1, 5, 20
"""Numbers of robots."""
SLOW = "0.05"
"""Speed of the simulation: its robots have all that those in real time have, and leave the machine free."""


def memory(tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure the memory of servers of 1, 5 and 20 robots, and of one of 20 robots in two processes.

    Args:
        tell: Called with a description of each measurement before it starts.

    Returns:
        Memory that no other process shares, with the proportional part of what is shared [MB], and the difference for
        each further robot.
    """
    few, more, many = [asyncio.run(_pss_mb(number, 1, tell)) for number in (FEW, MORE, MANY)]
    spread = asyncio.run(_pss_mb(MANY, 2, tell))
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
