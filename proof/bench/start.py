"""Starts of programs, beside bare interpreters that import what these need."""

import asyncio
import subprocess
import sys
import time
from collections.abc import Callable

from proof.bench.figure import Figure, figure, in_alternation
from tvist_lab.bench.moving import Run
from tvist_lab.served import served

REPETITIONS = 7
LIBRARIES = "import numba, numpy, pinocchio, ruckig, msgspec, zenoh"
"""What a served robot needs of others."""
SMALL = "import msgspec, zenoh"
"""What a client needs of others."""


def start(tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure starts with compiled kernels on disk.

    Args:
        tell: Called with a description of the measurement before it starts.
    """
    tell("starts beside bare interpreters")
    runs: dict[str, Run] = {
        "serve": _serve,
        "libraries": _interpreter("-c", LIBRARIES),
        "help": _interpreter("-m", "tvist_cli", "--help"),
        "client": _interpreter("-c", "import tvist_client"),
        "used_client": _interpreter("-c", "from tvist_client import Robot"),
        "small": _interpreter("-c", SMALL),
    }
    found = in_alternation(runs, REPETITIONS)
    libraries, small = "importing its libraries", "importing msgspec and zenoh"
    return {
        "serve_to_state_s": figure(
            "tvist serve until its first state", "s", found["serve"], libraries, found["libraries"]
        ),
        "help_s": figure("tvist --help", "s", found["help"], small, found["small"]),
        "import_client_s": figure("import tvist_client", "s", found["client"], small, found["small"]),
        "import_robot_s": figure(
            "from tvist_client import Robot", "s", found["used_client"], small, found["small"]
        ),
    }


def _serve() -> float:
    async def first_state() -> float:
        async with served(["--clock", "realtime"]) as server:
            return server.took

    return asyncio.run(first_state())


def _interpreter(*arguments: str) -> Run:
    def run() -> float:
        began = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - began

    return run
