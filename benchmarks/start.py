"""Starts of programs, compared with bare interpreters that import the same libraries."""

import asyncio
import os
import subprocess
import sys
import time
from tempfile import TemporaryDirectory
from unittest.mock import patch

from benchmarks.figure import Figure, Tell, figure, in_alternation
from tvist_lab.bench.moving import Run
from tvist_lab.served import served

REPETITIONS = 7
LIBRARIES = "import numba, numpy, pinocchio, ruckig, msgspec, zenoh"  # libraries of a served robot
SMALL = "import msgspec, zenoh"  # libraries of a client


def start(tell: Tell) -> dict[str, Figure]:
    """Measure starts with compiled kernels on disk, and one without."""
    tell("starts beside bare interpreters")
    libraries, small = "importing its libraries", "importing msgspec and zenoh"
    runs: dict[str, Run] = {
        "tvist serve until its first state": _serve,
        libraries: _interpreter("-c", LIBRARIES),
        "tvist --help": _interpreter("-m", "tvist_cli", "--help"),
        "import tvist_client": _interpreter("-c", "import tvist_client"),
        "from tvist_client import Robot": _interpreter("-c", "from tvist_client import Robot"),
        small: _interpreter("-c", SMALL),
    }
    # An installation has bytecode on disk, even if this process writes none.
    with TemporaryDirectory() as bytecode, patch.dict(os.environ, {"PYTHONPYCACHEPREFIX": bytecode}):
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        found = in_alternation(runs, REPETITIONS)
        tell("a first start, which compiles what no distribution brings along")
        with TemporaryDirectory() as kernels, patch.dict(os.environ, {"NUMBA_CACHE_DIR": kernels}):
            first = _serve()
    figures = {
        key: figure(what, "s", found[what], reference, found[reference])
        for key, what, reference in (
            ("serve_to_state_s", "tvist serve until its first state", libraries),
            ("help_s", "tvist --help", small),
            ("import_client_s", "import tvist_client", small),
            ("import_robot_s", "from tvist_client import Robot", small),
        )
    }
    usual = figures["serve_to_state_s"]
    cold = f"{usual.what}, without what this machine has compiled"
    figures["first_start_s"] = figure(cold, "s", [first], "with kernels on disk", [usual.value])
    return figures


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
