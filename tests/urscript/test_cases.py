"""The language by examples: each case is a script and what it says, writes, or is wrong with it.

A table of a file of `cases/` is a subject, each of its entries a case: `prog` is the body of a program called prog,
`script` a whole text.
"""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tvist_urscript.compiler import compile_script
from tvist_urscript.errors import ScriptError
from tvist_urscript.machine import Machine

from .dry_functions import Memory

CASES = [
    pytest.param(case, id=f"{path.stem}, {subject}: {name}")
    for path in sorted((Path(__file__).parent / "cases").glob("*.toml"))
    for subject, cases in tomllib.loads(path.read_text(encoding="utf-8")).items()
    for name, case in cases.items()
]
KNOWN = {"prog", "script", "says", "error", "ticks", "inputs", "calls"}
REGISTERS = {"int_registers": "int", "double_registers": "double", "bit_registers": "bit"}


BUDGET = 20_000
"""Evaluations of a tick: many more than beside a robot, as nothing else has to run in it."""
LONGEST_RUN = 2_000
"""Ticks after which a run is given up."""


@dataclass
class DryRun:
    """What a script has done without a robot."""

    memory: Memory = field(default_factory=Memory)
    ticks: int = 0
    ended: bool = False
    error: ScriptError | None = None


def dry_run(text, inputs):
    """Run a script; `inputs` are the contents of the input registers from 0 on, by kind."""
    run = DryRun()
    for kind, values in (inputs or {}).items():
        run.memory.inputs[kind].update(enumerate(values))
    table = run.memory.functions()
    try:
        script = compile_script(text, {name: entry[0] for name, entry in table.items()})
        machine = Machine(script, {name: entry[1] for name, entry in table.items()})
        while machine.running and run.ticks < LONGEST_RUN:
            run.ticks += 1
            machine.resume(BUDGET)
    except ScriptError as error:
        run.error = error
        return run
    run.ended = not machine.running
    machine.end()
    return run


def script_of(case):
    """The script of a case, whose lines are a text or, where they are few, a list."""
    lines = case.get("prog") or case["script"]
    if not isinstance(lines, str) or "\n" not in lines:
        indent = "  " if "prog" in case else ""
        lines = "".join(f"{indent}{line}\n" for line in ([lines] if isinstance(lines, str) else lines))
    return f"def prog():\n{lines}end\n" if "prog" in case else lines


@pytest.mark.parametrize("case", CASES)
def test_case(case):
    assert set(case) <= KNOWN | set(REGISTERS)
    run = dry_run(script_of(case), case.get("inputs"))
    error = case.get("error")
    if error is None:
        assert run.error is None
        assert run.ended
    else:
        assert run.error is not None
        assert error.get("text", "") in run.error.text
        assert all(getattr(run.error, key) == error[key] for key in error.keys() & {"line", "column"}), (
            run.error
        )
    if "says" in case:
        assert run.memory.said == case["says"]
    if "ticks" in case:
        assert run.ticks == case["ticks"]
    if "calls" in case:
        assert run.memory.calls == case["calls"]
    for name, kind in REGISTERS.items():
        for address, value in case.get(name, {}).items():
            assert run.memory.outputs[kind][int(address)] == value


def test_no_case_is_lost():
    assert len(CASES) >= 790
