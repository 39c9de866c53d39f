"""How long tests took, kept in durations.json: it says what begins first, and what is quick.

When tests run side by side, what is longest begins first. `pytest --quick` runs of each test function as many cases as
fit into a short time, spread over all, and none of one whose single case takes long. `pytest --turn 1/2` runs all that
is quick and, of what is not, every second case. `pytest --keep-durations` writes the seconds of every test function
that it ran, set-up and end included, its cases taken together; what it did not run keeps its figure, and what is no
longer there is dropped.
"""

import json
import math
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
KEPT = Path(__file__).with_name("durations.json")
LEAST = 0.1
"""Shorter test functions are kept as one sum a file [s]."""
OTHERS = "the others"
QUICK, LONGEST = 1.5, 1.5
"""How long the cases of a quick test function may take together, and how long one [s]."""
CLOCK = "clock"
"""The group of tests that need time to pass: one process has them all, so there is only one of them at a time."""


def kept():
    """Seconds by file and test function, of the last runs that were kept."""
    return json.loads(KEPT.read_text()) if KEPT.exists() else {}


def quick(items):
    """The cases that `pytest --quick` runs."""
    seconds = kept()
    functions = defaultdict(list)
    for item in items:
        if not item.get_closest_marker("nightly"):
            functions[_function(item.nodeid)].append(item)
    return [item for (file, test), cases in functions.items() for item in _few(cases, seconds, file, test)]


def in_turn(items, turn, turns):
    """All cases that are quick, and an equal share of the others, the longest dealt out first."""
    seconds = kept()
    cases = defaultdict(int)
    for item in items:
        cases[_function(item.nodeid)] += 1

    def took(item):
        file, test = _function(item.nodeid)
        return seconds.get(file, {}).get(test, 0.0)

    slow = [item for item in items if took(item) > QUICK]
    slow.sort(key=lambda item: -took(item) / cases[_function(item.nodeid)])
    others = {item for at, item in enumerate(slow) if at % turns != turn - 1}
    return [item for item in items if item not in others]


def turn_of(text):
    """The number of a turn and of all turns, from such as 1/2."""
    turn, _, turns = text.partition("/")
    if not (turn.isdigit() and turns.isdigit() and 1 <= int(turn) <= int(turns)):
        raise pytest.UsageError(f"--turn {text}: it must be a number of a number, as in 1/2")
    return int(turn), int(turns)


def _few(cases, seconds, file, test):
    each = seconds.get(file, {}).get(test, 0.0) / len(cases)
    if each > LONGEST:
        return []
    apart = max(1, math.ceil(len(cases) * each / QUICK))
    return cases[::apart]


def _function(nodeid):
    """A test's file, and its function without case and group."""
    file, _, test = nodeid.partition("::")
    return file, test.partition("[")[0].partition("@")[0]


def arrange(items):
    """Let one process have each file's tests, one have all that need the clock, and the longest group begin first.

    The cases of a search go to any process.
    """
    seconds = kept()
    took = defaultdict(float)
    for item in items:
        file, _ = _function(item.nodeid)
        group = item.nodeid if item.get_closest_marker("search") else file
        group = CLOCK if item.get_closest_marker("realtime") else group
        item.add_marker(pytest.mark.xdist_group(group))
        took[group] = max(took[group], sum(seconds.get(file, {OTHERS: 10.0}).values()))
    took[CLOCK] = float("inf")
    items.sort(key=lambda item: -took[item.get_closest_marker("xdist_group").args[0]])


class Durations:
    """Adds up how long the tests of a run take, and writes it at the end."""

    def __init__(self):
        self.seconds = defaultdict(lambda: defaultdict(float))

    def pytest_runtest_logreport(self, report):
        file, test = _function(report.nodeid)
        self.seconds[file][test] += report.duration

    def pytest_sessionfinish(self):
        whole = {file: tests for file, tests in kept().items() if (ROOT / file).exists()} | {
            file: _rounded(tests) for file, tests in self.seconds.items()
        }
        lines = (f" {json.dumps(file)}: {json.dumps(whole[file])}" for file in sorted(whole))
        KEPT.write_text("{\n" + ",\n".join(lines) + "\n}\n")


def _rounded(tests):
    long = {test: round(took, 1) for test, took in sorted(tests.items()) if took >= LEAST}
    return long | {OTHERS: round(sum(took for took in tests.values() if took < LEAST), 1)}
