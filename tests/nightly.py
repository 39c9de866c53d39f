"""The record of the last nightly run: `make nightly` writes nightly.json; `python -m tests.nightly` checks it."""

import json
import subprocess
import sys
import time
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

RECORD = Path(__file__).with_name("nightly.json")
OLDEST = 150  # largest allowed number of commits since the recorded run


class NightlyRecord:
    """Counts the outcomes of a run, and writes them at its end, with commit, date and duration."""

    def __init__(self):
        self.counts, self.failed, self.began = Counter(), [], time.monotonic()

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.failed.append(report.nodeid.partition("@")[0])
        if report.when == "call" or report.outcome != "passed":
            self.counts[report.outcome] += 1

    def pytest_collectreport(self, report):
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_sessionfinish(self, session, exitstatus):
        if exitstatus not in (0, 1) or session.config.option.keyword:  # interrupted, or not whole
            return
        run = {
            "commit": _git("rev-parse", "HEAD"),
            "date": f"{datetime.now(UTC):%Y-%m-%d}",  # noqa: TID251  a date is meant
            "seconds": round(time.monotonic() - self.began),
            "counts": dict(sorted(self.counts.items())),
            "failed": sorted(set(self.failed)),
        }
        RECORD.write_text(json.dumps(run, indent=1) + "\n")


def complaint(run, age):
    """Return what is wrong with a record that is `age` commits old; None if nothing is.

    An `age` of None means that its commit is not in the history.
    """
    if run["failed"]:
        return f"the nightly run of {run['date']} failed: {', '.join(run['failed'])}"
    if not run["counts"].get("passed"):
        return f"the nightly run of {run['date']} ran no test"
    if age is None:
        return f"the commit of the nightly run, {run['commit'][:8]}, is not in the history"
    if age > OLDEST:
        return f"the nightly run of {run['date']} is {age} commits old; at most {OLDEST} are allowed"
    return None


def main():
    if _git("rev-parse", "--is-shallow-repository") == "true":
        sys.stderr.write("tests/nightly.json: not checked, since this clone has not all commits\n")
        return
    run = json.loads(RECORD.read_text())
    ancestor = ["git", "merge-base", "--is-ancestor", run["commit"], "HEAD"]
    known = subprocess.run(ancestor, check=False, capture_output=True)
    age = int(_git("rev-list", "--count", f"{run['commit']}..HEAD")) if known.returncode == 0 else None
    wrong = complaint(run, age)
    if wrong is not None:
        sys.exit(f"tests/nightly.json: {wrong}. Run `make nightly` and commit the file.")


def _git(*arguments):
    return subprocess.run(["git", *arguments], check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    main()
