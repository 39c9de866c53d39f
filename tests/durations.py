"""How long tests took, kept in durations.json: it says what begins first, what is quick, and what is too slow.

`pytest --keep-durations`, of which `make durations` is the whole, writes the file anew: the seconds of every test
function, set-up and end included and its cases taken together, and on which machine. When tests run side by side, what
is longest begins first. `pytest --quick` runs of each test function as many cases as fit into a short time, spread over
all, and none of one whose single case takes long. `python -m tests.durations` fails if a test is beyond its budget.
"""

import json
import math
import os
import platform
import sys
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path

import pytest

KEPT = Path(__file__).with_name("durations.json")
LEAST = 0.1
"""Shorter test functions are kept as one sum a file [s]."""
OTHERS = "the others"
UNKNOWN = 10.0
"""What a file without figures is taken to need [s]."""
QUICK = 0.5
"""How long the cases of a quick test function may take together, and how long one [s]."""
FUNCTION, FILE, CLOCKED = 4.0, 20.0, 450.0
"""Budgets of a test function, of a file, and of all tests that need the clock [s]."""
CLOCK = "clock"
"""The group of tests that need time to pass: one process has them all, so there is only one of them at a time."""


def kept():
    """Seconds by file and test function, of the last run that was kept."""
    return json.loads(KEPT.read_text())["seconds"] if KEPT.exists() else {}


def quick(items):
    """The cases that `pytest --quick` runs."""
    seconds = kept()
    functions = defaultdict(list)
    for item in items:
        if not item.get_closest_marker("nightly"):
            functions[function_of(item.nodeid)].append(item)
    return [item for (file, test), cases in functions.items() for item in _few(cases, seconds, file, test)]


def _few(cases, seconds, file, test):
    each = seconds.get(file, {test: UNKNOWN}).get(test, 0.0) / len(cases)
    if each > QUICK:
        return []
    apart = max(1, math.ceil(len(cases) * each / QUICK))
    return cases[::apart]


def function_of(nodeid):
    """A test's file, and its function without case and group."""
    file, _, test = nodeid.partition("::")
    return file, test.partition("[")[0].partition("@")[0]


def arrange(items):
    """Let one process have each file's tests, one have all that need the clock, and the longest group begin first.

    The cases of a search go to any process, last.
    """
    seconds = kept()
    took = defaultdict(float)
    for item in items:
        file, _ = function_of(item.nodeid)
        group = CLOCK if item.get_closest_marker("realtime") else file
        took[group] = sum(seconds.get(file, {OTHERS: UNKNOWN}).values())
        group = item.nodeid if item.get_closest_marker("search") else group
        item.add_marker(pytest.mark.xdist_group(group))
    took[CLOCK] = float("inf")
    items.sort(key=lambda item: -took[item.get_closest_marker("xdist_group").args[0]])


class Durations:
    """Adds up how long the tests of a run take, and writes it at the end."""

    def __init__(self):
        self.seconds = defaultdict(lambda: defaultdict(float))
        self.clocked = 0.0

    def pytest_runtest_logreport(self, report):
        file, test = function_of(report.nodeid)
        self.seconds[file][test] += report.duration
        if "realtime" in report.keywords:
            self.clocked += report.duration

    def pytest_sessionfinish(self):
        machine = {
            "date": f"{datetime.now(UTC):%Y-%m-%d}", "cpus": os.cpu_count(), "machine": platform.machine(),
            "python": platform.python_version(), "clocked": round(self.clocked, 1),
        }  # fmt: skip
        lines = (
            f"  {json.dumps(file)}: {json.dumps(_rounded(tests))}"
            for file, tests in sorted(self.seconds.items())
        )
        seconds = ",\n".join(lines)
        KEPT.write_text(f'{{\n "run": {json.dumps(machine)},\n "seconds": {{\n{seconds}\n }}\n}}\n')


def _rounded(tests):
    long = {test: round(took, 1) for test, took in sorted(tests.items()) if took >= LEAST}
    return long | {OTHERS: round(sum(took for took in tests.values() if took < LEAST), 1)}


def beyond(content):
    """Say of each budget that a run has exceeded by how much."""
    for file, tests in content["seconds"].items():
        yield from (
            f"{file}::{test} took {took:g} s: at most {FUNCTION:g} s"
            for test, took in tests.items()
            if test != OTHERS and took > FUNCTION
        )
        if (whole := sum(tests.values())) > FILE:
            yield f"{file} took {whole:.1f} s: at most {FILE:g} s"
    if (clocked := content["run"]["clocked"]) > CLOCKED:
        yield f"the tests that need the clock took {clocked:g} s: at most {CLOCKED:g} s"


if __name__ == "__main__":
    found = list(beyond(json.loads(KEPT.read_text())))
    sys.exit("\n".join([*found, "make them smaller or nightly, then `make durations`"]) if found else 0)
