"""Results of acceptance tests: each test notes its own; they make the page of tested clients.

python3 tests/acceptance/report.py
"""

import json
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "docs/reference/ur-clients.json"
PAGE = RESULTS.with_suffix(".md")
BEGIN, END = "<!-- results: tests/acceptance/report.py makes them -->\n", "<!-- end of the results -->\n"
PASSED = "passed"


def note(client: str, version: str, outcomes: Mapping[str, str], why: Mapping[str, str]) -> None:
    """Keep the outcome of each test or call of a client, and why some are known to fail."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    git = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    failed = {name: came for name, came in outcomes.items() if came != PASSED}
    others = {name: f"{came}: {why[name]}" if name in why else came for name, came in failed.items()}
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    today = datetime.now(UTC)  # noqa: TID251  a date is meant
    results[client] = {
        "version": version, "date": f"{today:%Y-%m-%d}", "tvist": git.stdout.strip(),
        "passed": [name for name in outcomes if name not in others], "others": others,
    }  # fmt: skip
    RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")
    PAGE.write_text(with_results(PAGE.read_text(), results))


def with_results(page: str, results: Mapping[str, Any]) -> str:
    """Return the page with these results instead of its present ones."""
    lines = ["| client | version | on | TVIST | passed |", "|---|---|---|---|---:|"]
    counts: dict[str, list[int]] = {}
    for client, one in sorted(results.items()):
        row = f"| {client.partition(':')[0]} | {one['version']} | {one['date']} | `{one['tvist']}` |"
        passed, failed = counts.setdefault(row, [0, 0])
        counts[row] = [passed + len(one["passed"]), failed + len(one["others"])]
    lines += [f"{row} {passed} of {passed + failed} |" for row, (passed, failed) in counts.items()]
    lines += ["", "Not passed:", ""]
    for client, one in sorted(results.items()):
        alike: dict[str, list[str]] = {}
        for name, came in sorted(one["others"].items()):
            alike.setdefault(came, []).append(f"`{name}`")
        lines += [f"- {client}: {', '.join(names)}: {came}" for came, names in alike.items()]
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(with_results(PAGE.read_text(), json.loads(RESULTS.read_text())))
