"""Durations of tests, kept in durations.json: what starts first, what is quick, what is too slow.

`make durations` runs `pytest --keep-durations`, which writes the file: the seconds of each test
function with set-up, teardown and all its cases. Parallel runs start with the longest tests.
`pytest --quick` runs as many cases of each function, evenly spread, as fit into a short time.
`python -m tests.durations` fails if a test exceeds its budget or a file has no entry.
"""

import json
import math
import os
import platform
import re
import sys
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path

import pytest

KEPT = Path(__file__).with_name("durations.json")
LEAST = 0.1  # shorter test functions are summed up for each file [s]
OTHERS = "the others"
UNKNOWN = 10.0  # assumed duration of a file without an entry [s]
QUICK = 0.5  # longest time of a quick test function's cases together, and of a single case [s]
FUNCTION, FILE, CLOCKED = 4.0, 20.0, 450.0
"""Budgets of a test function, of a file, and of all real-time tests [s]."""
CLOCK = "clock"  # group of the real-time tests: one process runs them, one after the other


def kept():
    """Return the seconds by file and test function of the last kept run."""
    return json.loads(KEPT.read_text())["seconds"] if KEPT.exists() else {}


def quick(items):
    """Return the cases that `pytest --quick` runs."""
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
    """Split a test's id into its file and its function, without case and group."""
    file, _, test = nodeid.partition("::")
    return file, test.partition("[")[0].partition("@")[0]


def arrange(items):
    """Group tests by file, real-time tests in one group, and start with the longest group.

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
    """Adds up the durations of a run's tests, and writes them at its end."""

    def __init__(self):
        self.seconds = defaultdict(lambda: defaultdict(float))
        self.clocked = 0.0

    def pytest_runtest_logreport(self, report):
        file, test = function_of(report.nodeid)
        self.seconds[file][test] += report.duration
        if "realtime" in report.keywords:
            self.clocked += report.duration

    def pytest_sessionfinish(self):
        today = datetime.now(UTC)  # noqa: TID251  a date is meant
        machine = {
            "date": f"{today:%Y-%m-%d}", "cpus": os.cpu_count(), "machine": platform.machine(),
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


def exceeded(content):
    """Yield each budget that a run exceeded, and by how much."""
    for file, tests in content["seconds"].items():
        yield from (
            f"{file}::{test} took {took:g} s: at most {FUNCTION:g} s"
            for test, took in tests.items()
            if test != OTHERS and took > FUNCTION
        )
        if (whole := sum(tests.values())) > FILE:
            yield f"{file} took {whole:.1f} s: at most {FILE:g} s"
    if (clocked := content["run"]["clocked"]) > CLOCKED:
        yield f"the real-time tests took {clocked:g} s: at most {CLOCKED:g} s"


def unlisted(seconds, folder=KEPT.parent):
    """Yield the test files without an entry, except those with nightly tests only."""
    for path in sorted(folder.rglob("test_*.py")):
        text, file = path.read_text(encoding="utf-8"), path.relative_to(folder.parent).as_posix()
        tests = len(re.findall(r"^ *(?:async )?def test_", text, re.MULTILINE))
        nightly = re.search(r"^pytestmark = .*nightly", text, re.MULTILINE)
        if file not in seconds and not nightly and text.count("mark.nightly") < tests:
            yield f"{file} has no entry in {KEPT.name}"


if __name__ == "__main__":
    measured = json.loads(KEPT.read_text())
    found = [*exceeded(measured), *unlisted(measured["seconds"])]
    sys.exit("\n".join([*found, "make tests smaller or nightly, then run `make durations`"]) if found else 0)
