"""Starts of programs, beside bare interpreters that import what these need."""

import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from statistics import median
from tempfile import TemporaryDirectory

from proof.bench.figure import Figure, figure, in_alternation
from tvist_lab.bench.moving import Run
from tvist_lab.served import served

REPETITIONS = 7
LIBRARIES = "import numba, numpy, pinocchio, ruckig, msgspec, zenoh"
"""What a served robot needs of others."""
WITHOUT = ("PYTHONDONTWRITEBYTECODE",)
"""What keeps Python from writing bytecode."""
SMALL = "import msgspec, zenoh"
"""What a client needs of others."""


def start(tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure starts with compiled kernels on disk, and one without.

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
    # An installation has its bytecode on disk, whether or not this process writes any.
    with TemporaryDirectory() as bytecode, _environment({"PYTHONPYCACHEPREFIX": bytecode}, WITHOUT):
        found = in_alternation(runs, REPETITIONS)
        tell("a first start, which compiles what no distribution brings along")
        with TemporaryDirectory() as kernels, _environment({"NUMBA_CACHE_DIR": kernels}):
            first = _serve()
    libraries, small = "importing its libraries", "importing msgspec and zenoh"
    return {
        "serve_to_state_s": figure(
            "tvist serve until its first state", "s", found["serve"], libraries, found["libraries"]
        ),
        "first_start_s": figure(
            "tvist serve until its first state, without what this machine has compiled",
            "s",
            [first],
            "with kernels on disk",
            [median(found["serve"])],
        ),
        "help_s": figure("tvist --help", "s", found["help"], small, found["small"]),
        "import_client_s": figure("import tvist_client", "s", found["client"], small, found["small"]),
        "import_robot_s": figure(
            "from tvist_client import Robot", "s", found["used_client"], small, found["small"]
        ),
    }


@contextmanager
def _environment(given: Mapping[str, str], without: tuple[str, ...] = ()) -> Iterator[None]:
    """Give the programs that are started meanwhile other environment variables."""
    before = dict(os.environ)
    try:
        os.environ.update(given)
        for name in without:
            os.environ.pop(name, None)
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


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
