"""All measurements of `tvist bench`, and a description of the machine."""

import asyncio
import os
import platform
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from typing import Any

from tvist_lab.bench.moving import Run, cycle_tick, line_tick, plant_tick
from tvist_lab.bench.served_robots import one_robot, robots_at_500_hz
from tvist_plant.plant import PERIOD
from tvist_server.punctual import processors

REPETITIONS = 7  # number of runs of which the median counts, after a warm-up
OF_MANY = 0.4  # time for which each number of robots is measured, as a share of the time for one robot [-]
LIBRARIES = ("tvist", "eclipse-zenoh", "mcap", "msgspec", "mujoco", "numba", "numpy", "pin", "ruckig")
"""Distributions whose versions affect speed."""


def speed(seconds: float, shaper: str, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure for `seconds` each; if 0, serve no robot. `tell` gets a description before each measurement."""
    result: dict[str, Any] = {
        "machine": this_machine(),
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


def this_machine() -> dict[str, Any]:
    """Describe this machine in its present state, on which the measured figures depend."""
    return {
        "cpu": _processor(),
        "cores": processors(),  # number of cores available to this process
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
        "libraries": {name: found for name in LIBRARIES if (found := _version(name)) is not None},
        "load": os.getloadavg()[0],  # average number of running processes in the minute before the start
    }


def _processor() -> str:
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
