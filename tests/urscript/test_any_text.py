"""Any text compiles or has an error with a position, and no tick exceeds its budget."""

import pytest

from tvist_urscript import Machine, ScriptError, compile_script
from tvist_urscript.expressions import MOST_OPERATIONS
from tvist_urscript.machine import OVERDRAFT

from .dry_functions import DryFunctions
from .programs import spoilt, valid

CI, NIGHTLY = 25, 3_000
BUDGET, TICKS = 300, 60
# A statement, and what it may exceed the budget by when it works on lists.
BEYOND = MOST_OPERATIONS + 2 * OVERDRAFT


def test_any_text_compiles_or_has_an_error():
    all_of(range(CI))


@pytest.mark.nightly
@pytest.mark.parametrize("part", range(10))
def test_many_texts_compile_or_have_an_error(part):
    all_of(range(CI + part, NIGHTLY, 10))


def all_of(seeds):
    for seed in seeds:
        assert runs_or_fails(valid(seed)) != "compile", seed
        runs_or_fails(spoilt(seed))


def runs_or_fails(text):
    dry = DryFunctions()
    try:
        script = compile_script(text, dry.signatures)
    except ScriptError as error:
        stands_in(error, text)
        return "compile"
    machine = Machine(script, dry.functions)
    try:
        for _ in range(TICKS):
            left = machine.resume(BUDGET)
            assert -MOST_OPERATIONS - OVERDRAFT <= left <= BUDGET
            assert machine.left >= -BEYOND
            if not machine.running:
                return "ended"
        machine.end()
    except ScriptError as error:
        stands_in(error, text)
        assert not machine.running
        return "failed"
    return "runs"


def stands_in(error, text):
    lines = text.split("\n")
    assert 1 <= error.line <= len(lines)
    assert 1 <= error.column <= len(lines[error.line - 1]) + 1
    assert error.text
