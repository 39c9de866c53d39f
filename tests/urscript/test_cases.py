"""The language by examples: each case is a script and what it says, writes, or is wrong with it.

A table of a file of `cases/` is a subject, each of its entries a case: `prog` is the body of a program called prog,
`script` a whole text.
"""

import tomllib
from pathlib import Path

import pytest

from tvist_urscript.compiler import compile_script
from tvist_urscript.errors import ScriptError
from tvist_urscript.machine import Machine

from .dry_functions import DryFunctions

CASES = [
    pytest.param(case, id=f"{path.stem}, {subject}: {name}")
    for path in sorted((Path(__file__).parent / "cases").glob("*.toml"))
    for subject, cases in tomllib.loads(path.read_text(encoding="utf-8")).items()
    for name, case in cases.items()
]
KNOWN = {"prog", "script", "says", "error", "ticks"}
BUDGET = 20_000  # evaluations of a tick: many more than beside a robot, as nothing else has to run in it
LONGEST_RUN = 2_000  # ticks after which a run is given up


def script_of(case):
    """The script of a case, whose lines are a text or, where they are few, a list."""
    lines = case.get("prog") or case["script"]
    if not isinstance(lines, str) or "\n" not in lines:
        indent = "  " if "prog" in case else ""
        lines = "".join(f"{indent}{line}\n" for line in ([lines] if isinstance(lines, str) else lines))
    return f"def prog():\n{lines}end\n" if "prog" in case else lines


@pytest.mark.parametrize("case", CASES)
def test_each_example_script_has_its_expected_result(case):
    assert set(case) <= KNOWN
    dry, error, ticks = DryFunctions(), None, 0
    try:
        machine = Machine(compile_script(script_of(case), dry.signatures), dry.functions)
        while machine.running and ticks < LONGEST_RUN:
            machine.resume(BUDGET)
            ticks += 1
    except ScriptError as raised:
        error = raised
    wanted = case.get("error")
    if wanted is None:
        assert error is None
        assert ticks == case.get("ticks", ticks) < LONGEST_RUN
    else:
        assert wanted.get("text", "") in error.text
        assert all(getattr(error, key) == wanted[key] for key in wanted.keys() & {"line", "column"}), error
    assert dry.said == case.get("says", dry.said)


def test_all_cases_are_found():
    assert len(CASES) >= 760
