"""Speed on this machine: of each part, of the whole control line, of a served robot, and the number of robots."""

import asyncio
from collections.abc import Callable
from typing import Any

from tvist_lab.benchmark.many_robots import robots_at_500_hz, us_per_robot_and_tick
from tvist_lab.benchmark.memory import memory
from tvist_lab.benchmark.observed import observed
from tvist_lab.benchmark.one_robot import one_robot
from tvist_lab.benchmark.parts import parts
from tvist_lab.benchmark.programs import programs
from tvist_lab.benchmark.shapers import shapers
from tvist_lab.benchmark.ur_interfaces import ur_interfaces, with_a_program

OF_MANY = 0.4
"""Time for which each number of robots is measured, as a share of the time for one robot [-]."""


def bench(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run all measurements.

    Args:
        seconds: How long to measure a served robot; 0 to skip this.
        tell: Called with a description of each measurement before it starts.
    """
    result: dict[str, Any] = parts(tell)
    result["shapers"] = shapers(tell)
    result["programs"] = programs(tell)
    if seconds > 0.0:
        result |= asyncio.run(one_robot(seconds, tell))
        result["ur_interfaces"] = asyncio.run(ur_interfaces(seconds, tell))
        result["ur_interfaces_with_a_program"] = asyncio.run(with_a_program(OF_MANY * seconds, tell))
        result["observers"] = asyncio.run(observed(OF_MANY * seconds, tell))
        result["memory"] = asyncio.run(memory(tell))
        result["robot_us_per_tick"] = asyncio.run(us_per_robot_and_tick(OF_MANY * seconds, tell))
        result["line_share_of_robot"] = result["line_us_per_tick"] / result["robot_us_per_tick"]
        result["robots_at_500_hz"] = asyncio.run(robots_at_500_hz(max(2.0, OF_MANY * seconds), tell))
    return result
