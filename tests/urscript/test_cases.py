"""The language by examples: each case is a script and what it says, writes, or is wrong with it."""

import tomllib
from pathlib import Path

import pytest

from .dry_run import dry_run

CASES = [
    pytest.param(case, id=f"{path.stem}: {case['name']}")
    for path in sorted((Path(__file__).parent / "cases").glob("*.toml"))
    for case in tomllib.loads(path.read_text(encoding="utf-8"))["case"]
]
KNOWN = {"name", "section", "script", "says", "error", "ticks", "inputs", "calls"}
REGISTERS = {"int_registers": "int", "double_registers": "double", "bit_registers": "bit"}


@pytest.mark.parametrize("case", CASES)
def test_case(case):
    assert set(case) <= KNOWN | set(REGISTERS)
    run = dry_run(case["script"], case.get("inputs"))
    error = case.get("error")
    if error is None:
        assert run.error is None
        assert run.ended
    else:
        assert run.error is not None
        for key in error:
            if key == "text":
                assert error[key] in run.error.text
            else:
                assert getattr(run.error, key) == error[key], run.error
    if "says" in case:
        assert run.memory.said == case["says"]
    if "ticks" in case:
        assert run.ticks == case["ticks"]
    if "calls" in case:
        assert run.memory.calls == case["calls"]
    for name, kind in REGISTERS.items():
        for address, value in case.get(name, {}).items():
            assert run.memory.outputs[kind][int(address)] == value


def test_there_are_cases_of_each_section():
    assert {case.values[0]["section"].split()[0].split(".")[0] for case in CASES} >= {"1", "2", "3", "5", "6"}
