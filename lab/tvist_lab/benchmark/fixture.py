"""Start of a robot by the fixture of `tvist_testing`, compared with that of `tvist serve`, in turn in one run."""

import asyncio
import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tvist_lab.served import served

ROUNDS = 5
"""Number of sessions of tests; between them `tvist serve` starts."""
TESTS = """
import json, time, pytest

@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    began = time.monotonic()
    yield
    if fixturedef.argname == "tvist_robot":
        TOOK.append(time.monotonic() - began)

TOOK = []

def pytest_unconfigure():
    with open("took.json", "w") as file:
        json.dump(TOOK, file)
"""
EACH = """
import pytest

@pytest.mark.parametrize("number", range({tests}))
def test_it(tvist_robot, number):
    assert tvist_robot.state().tick == 0
"""


def fixture(tests: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure sessions of pytest with the fixture `tvist_robot`, and starts of `tvist serve`, in turn.

    Args:
        tests: Number of tests in each session, at least 2.
        tell: Called with a description of each step before it starts.

    Returns:
        Medians: time from the start of `tvist serve` in lockstep until it answers [s]; time of a session's first
        fixture and of the later ones [s]; ratios of these to the time of `tvist serve`.
    """
    answered: list[float] = []
    first: list[float] = []
    later: list[float] = []
    for number in range(ROUNDS):
        tell(f"round {number + 1} of {ROUNDS}: tvist serve, then {tests} tests")
        answered.append(asyncio.run(_served()))
        fixtures = _session(tests)
        first.append(fixtures[0])
        later += fixtures[1:]
    serve_s = statistics.median(answered)
    return {
        "serve_s": serve_s,
        "first_fixture_s": statistics.median(first),
        "later_fixture_s": statistics.median(later),
        "first_ratio": statistics.median(first) / serve_s,
        "later_ratio": statistics.median(later) / serve_s,
    }


async def _served() -> float:
    """Time until `tvist serve` answers [s]."""
    async with served(["--clock", "lockstep"]) as server:
        return server.took


def _session(tests: int) -> list[float]:
    """Time of each fixture in a session of tests [s]."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "conftest.py").write_text(TESTS, encoding="utf-8")
        Path(folder, "test_each.py").write_text(EACH.format(tests=tests), encoding="utf-8")
        run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", folder]
        subprocess.run(run, cwd=folder, check=True, capture_output=True)  # noqa: S603  our own interpreter and tests
        took: list[float] = json.loads(Path(folder, "took.json").read_text(encoding="utf-8"))
        return took
