"""`pytest --known-skips` fails unless it skips exactly the tests in skips.json, which names a command for each."""

import json
from pathlib import Path

from tests.durations import function_of

KEPT = Path(__file__).with_name("skips.json")


class Skips:
    """Fails a run whose skipped tests differ from the known ones."""

    def __init__(self):
        self.skipped, self.wrong = set(), []

    def pytest_collectreport(self, report):
        if report.skipped:
            self.skipped.add(report.nodeid)

    def pytest_runtest_logreport(self, report):
        if report.skipped and not hasattr(report, "wasxfail"):
            self.skipped.add("::".join(function_of(report.nodeid)))

    def pytest_sessionfinish(self, session):
        known = set(json.loads(KEPT.read_text()))
        self.wrong = [f"skipped, and not in skips.json: {one}" for one in sorted(self.skipped - known)]
        self.wrong += [f"in skips.json, and not skipped: {one}" for one in sorted(known - self.skipped)]
        if self.wrong and session.exitstatus == 0:
            session.exitstatus = 1

    def pytest_terminal_summary(self, terminalreporter):
        for line in self.wrong:
            terminalreporter.write_line(line)
