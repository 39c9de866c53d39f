"""How fast it is on this machine: each part alone, the whole line, a served robot, and how many of them."""

import asyncio
from collections.abc import Callable
from typing import Any

from tvist_lab.benchmark.many_robots import robots_at_500_hz
from tvist_lab.benchmark.one_robot import one_robot
from tvist_lab.benchmark.parts import parts
from tvist_lab.benchmark.ur_interfaces import ur_interfaces

OF_MANY = 0.4
"""Share of the time for one robot that each number of robots is watched."""


def bench(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure everything.

    Args:
        seconds: How long to watch a served robot; 0: not at all.
        tell: Told of what is measured next.
    """
    result: dict[str, Any] = parts(tell)
    if seconds > 0.0:
        result |= asyncio.run(one_robot(seconds, tell))
        result["ur_interfaces"] = asyncio.run(ur_interfaces(seconds, tell))
        result["robots_at_500_hz"] = asyncio.run(robots_at_500_hz(max(2.0, OF_MANY * seconds), tell))
    return result
