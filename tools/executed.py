"""Record which test executes which line, also in programs that tests start, for `tools.mutants`."""

import json
import os
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from importlib import import_module
from itertools import accumulate
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, run

ROOT = Path(__file__).parents[1]
AT_START = """
import atexit, os, runpy, sys
def begin():
    import coverage
    test, _, when = os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")
    whose = test if when == "(call)" else test.partition("::")[0]  # what a fixture starts is the file's
    one = coverage.Coverage({data!r}, True, config_file={rc!r}, context=whose)
    one.start()
    atexit.register(lambda: (one.stop(), one.save()))
def after_begin(run):
    return lambda *given, **named: (begin(), run(*given, **named))[1]
if "tests.nursery" in sys.orig_argv:
    runpy.run_module, runpy.run_path = after_begin(runpy.run_module), after_begin(runpy.run_path)
elif "PYTEST_CURRENT_TEST" in os.environ:
    begin()
"""
"""Code that programs started by a test run first, or after a fork; an environment variable names the test."""


def cover(folder: Path, *arguments: Annotated[str, Parameter(allow_leading_hyphen=True)]) -> None:
    """Run tests in parallel, and store in FOLDER which lines they execute.

    Install pytest-cov first.

    Args:
        folder: Folder of the results.
        arguments: Further arguments of pytest, such as a file of tests.
    """
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    data, rc = str(folder / "coverage"), str(folder / "rc")
    quiet = "disable_warnings = no-data-collected, module-not-imported"
    Path(rc).write_text(
        f"[run]\ndata_file = {data}\ninclude = {ROOT}/*/tvist_*/*\n{quiet}\n", encoding="utf-8"
    )
    (folder / "sitecustomize.py").write_text(AT_START.format(data=data, rc=rc), encoding="utf-8")
    side_by_side = ["-n2", "--dist=loadgroup", "-m", "not nightly"]
    notes = ["--cov", f"--cov-config={rc}", "--cov-context=test", "--cov-report="]
    paths = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "pytest", *side_by_side, *notes, *arguments]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": paths}, check=False)


@cache
def executed(folder: Path, file: str) -> dict[int, set[str]]:
    """Return for each line of a file the tests, or test files, that execute it."""
    data = import_module("coverage").CoverageData(str(folder.resolve() / "coverage"))
    data.read()
    lines: dict[int, list[str]] = data.contexts_by_lineno(str(ROOT / file))
    return {
        line: {re.sub(r"(@[^]@]*)?([|].*)?$", "", one) for one in of if one} for line, of in lines.items()
    }


def shortest(tests: set[str], together: float) -> list[str]:
    """Return the shortest tests that together take at most a time [s] according to `durations.json`."""
    kept = json.loads((ROOT / "tests" / "durations.json").read_text(encoding="utf-8"))["seconds"]
    cases = Counter(one.partition("[")[0] for one in tests)

    def seconds(test: str) -> float:
        function = test.partition("[")[0]
        file, _, name = function.partition("::")
        of_file = kept.get(file, {})
        return float(of_file.get(name, 0.1) / cases[function] if name else sum(of_file.values()))

    ordered = sorted((seconds(one), one) for one in tests)
    until = accumulate(took for took, _ in ordered)
    return [test for (_, test), end in zip(ordered, until, strict=True) if end <= together]


if __name__ == "__main__":
    run(cover)
