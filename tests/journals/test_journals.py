"""What robots did once they do again: runs recorded earlier, replayed by the controller as it is now.

A difference is either an error or a deliberate change of what a robot does. After the latter the runs are made anew by
`make.py` and `thin.py`, and CHANGELOG says what is different.
"""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests.journals.thin import MADE_ON, processor

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import known_fields, replay_file
from tvist_protocol.recorded import THIS_BEHAVIOUR

RUNS = sorted(Path(__file__).parent.glob("*.mcap"))
POSITION = 1e-6
ROUNDING = {"_qd": 1e-4, "_speed": 1e-4, "_qdd": 1e-3, "_moment": 1e-3, "_accelerometer": 1e-3}
"""What another processor may make different in a value of about one, in SI units, by the end of its name.

The weights of `auto` and plans are solutions of programmes that are flat near their optimum, so that last bits make
some 1e-7 of a position, and differentiation makes more of that. What a robot does differs by more.
"""
DIGEST = """
import hashlib, sys
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_protocol.codec import encode
for path in sys.argv[1:]:
    print(hashlib.sha256(b"".join(map(encode, replay_file(read(path)).states))).hexdigest())
"""
"""Prints a hash of what the controller does in each of some runs."""
AS_MADE = MADE_ON.read_text(encoding="utf-8").strip() == processor()
"""Whether this processor computes as the one that made the runs did: then not a bit may differ."""


def test_there_are_runs_in_lockstep_and_live():
    assert len(RUNS) == 12
    assert sum(path.name.startswith("live") for path in RUNS) == 6


@pytest.mark.parametrize("path", RUNS, ids=lambda path: path.stem)
def test_a_recorded_run_comes_out_again(path):
    content = read(path)
    again = replay_file(content)
    states = {state.tick: state for state in again.states}
    assert len(content.states) > 15
    assert content.behaviour == THIS_BEHAVIOUR
    names = known_fields(content.states)
    for recorded in content.states:
        replayed = states[recorded.tick]
        for name in names:
            before, after = getattr(recorded, name), getattr(replayed, name)
            assert same(before, after, rounding(name)), (
                f"tick {recorded.tick}: {name} was {before}, is {after}"
            )
    assert list(map(told, again.events)) == list(map(told, content.events))


@pytest.mark.nightly
def test_what_is_compiled_for_any_processor_gives_the_same_bits(tmp_path):
    """As in the wheels of `tvist-compiled`; all that is not compiled is the same."""
    any_processor = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", DIGEST, *map(str, RUNS)]
    here, there = (
        subprocess.run(run, env={**os.environ, **given}, capture_output=True, text=True, check=True).stdout
        for given in ({}, any_processor)
    )
    assert len(here) > 64
    assert there == here


def test_a_run_of_another_behaviour_says_so():
    again = replay_file(replace(read(RUNS[0]), behaviour=1))
    assert any(f"is of behaviour 1, and this is {THIS_BEHAVIOUR}" in note for note in again.notes)


def rounding(name):
    """By how much a value may differ, as a share of one more than it."""
    return 0.0 if AS_MADE else next((most for end, most in ROUNDING.items() if name.endswith(end)), POSITION)


def same(before, after, most):
    if isinstance(before, list):
        return len(before) == len(after) and all(
            same(*pair, most) for pair in zip(before, after, strict=True)
        )
    if isinstance(before, float) and isinstance(after, float):
        return abs(after - before) <= most * (1.0 + abs(before)) or before == after
    return before == after


def told(event):
    return event.tick, event.kind, event.id, event.code, event.category
