"""All that `tvist bench` measures."""

import asyncio
from collections.abc import Callable
from statistics import median
from typing import Any

import msgspec

from tvist_lab.bench.machine import this_machine
from tvist_lab.bench.many_robots import robots_at_500_hz
from tvist_lab.bench.moving import Run, cycle_tick, line_tick, plant_tick
from tvist_lab.bench.one_robot import one_robot
from tvist_plant.plant import PERIOD

REPETITIONS = 7
"""Number of runs of which the median counts, after a first one that does not."""
OF_MANY = 0.4
"""Time for which each number of robots is measured, as a share of the time for one robot [-]."""


def speed(seconds: float, shaper: str, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure.

    Args:
        seconds: Duration of each measurement in real time [s]; 0 to serve no robot.
        shaper: Name of the robots' shaper.
        tell: Called with a description of each measurement before it starts.

    Raises:
        StartError: There is no such shaper.
    """
    result: dict[str, Any] = {
        "machine": msgspec.to_builtins(this_machine()),
        "seconds": seconds,
        "shaper": shaper,
    }
    tell("a robot in this process")
    line = _usual(line_tick(shaper))
    result |= {
        "plant_us_per_tick": _usual(plant_tick()),
        "cycle_us_per_tick": _usual(cycle_tick()),
        "line_us_per_tick": line,
        "realtime_factor": 1e6 * PERIOD / line,
    }
    if seconds > 0.0:
        options = ("--shaper", shaper)
        result |= asyncio.run(one_robot(seconds, tell, options))
        result["robots_at_500_hz"] = asyncio.run(robots_at_500_hz(max(2.0, OF_MANY * seconds), tell, options))
    return result


def _usual(run: Run) -> float:
    run()
    return median(run() for _ in range(REPETITIONS))
