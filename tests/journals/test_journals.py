"""What robots did once they do again: runs recorded earlier, replayed by the controller as it is now.

A difference is either an error or a deliberate change of what a robot does. After the latter the runs are made anew by
`make.py`, and CHANGELOG says what is different.
"""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests.journals.make import MADE_ON, make, processor

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import known_fields, replay_file
from tvist_protocol.recorded import THIS_BEHAVIOUR
from tvist_protocol.stream import Truth

FOLDER = Path(__file__).parent
RUNS = sorted(FOLDER.glob("*.mcap"))
QUICK = ("speeds", "tool_paths", "elastic_with_a_payload", "live_lost_lease")
"""Runs that are short, and different in what moves the arm."""
OTHERS = [path.stem for path in RUNS if path.stem not in QUICK]
POSITION = 1e-6
ROUNDING = {
    "_qd": 1e-4, "_speed": 1e-4, "_qdd": 1e-3, "_moment": 1e-3, "_accelerometer": 1e-3, "_acceleration": 1e-3,
    "shaper_delay": 2.1e-3,
}  # fmt: skip
"""What another processor may make different in a value of about one, in SI units, by the end of its name.

The weights of `auto` and plans are solutions of programmes that are flat near their optimum, so that last bits make
some 1e-7 of a position, and differentiation makes more of that. What a robot does differs by more. A delay is a number
of ticks, and may be one of the next.
"""
TOUCHED = 0.2
"""The same in a world, whose contacts magnify it."""
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


def test_a_remade_journal_has_the_same_inputs_and_events(tmp_path):
    before, made = FOLDER / "live_lost_lease.mcap", tmp_path / "made.mcap"
    make(before, made)
    old, new = read(before), read(made)
    assert (new.journal, new.start, new.info) == (old.journal, old.start, old.info)
    assert list(map(told, new.events)) == list(map(told, old.events))
    assert [state.tick for state in new.states] == [state.tick for state in old.states]


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.nightly) for name in OTHERS)]
)
def test_recorded_runs_are_reproduced(name):
    content = read(FOLDER / f"{name}.mcap")
    again = replay_file(content)
    assert again.notes == []  # such as that a scene is another one now
    assert len(content.states) > 15
    assert content.behaviour == THIS_BEHAVIOUR
    touched = content.start.get("plant", {}).get("place", "").startswith("world:")
    compare(content.states, again.states, known_fields(content.states), touched)
    compare(content.truths, again.truths, Truth.__struct_fields__, touched)
    assert list(map(told, again.events)) == list(map(told, content.events))


@pytest.mark.nightly
def test_replay_is_equal_with_kernels_compiled_for_any_processor(tmp_path):
    """The wheels of `tvist-compiled` contain such kernels; all other code is the same."""
    any_processor = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", DIGEST, *map(str, RUNS)]
    here, there = (
        subprocess.run(run, env={**os.environ, **given}, capture_output=True, text=True, check=True).stdout
        for given in ({}, any_processor)
    )
    assert len(here) > 64
    assert there == here


def test_a_journal_of_another_behaviour_number_adds_a_note():
    again = replay_file(replace(read(FOLDER / "live_lost_lease.mcap"), behaviour=1))
    assert any(f"is of behaviour 1, and this is {THIS_BEHAVIOUR}" in note for note in again.notes)


def compare(recorded, again, names, touched):
    replayed = {one.tick: one for one in again}
    for one in recorded:
        for name in names:
            before, after = getattr(one, name), getattr(replayed[one.tick], name)
            changed = f"tick {one.tick}: {name} was {before}, is {after}"
            assert same(before, after, rounding(name, touched)), changed


def rounding(name, touched):
    """Return by how much a value may differ, relative to one more than its size."""
    if AS_MADE or touched:
        return 0.0 if AS_MADE else TOUCHED
    return next((most for end, most in ROUNDING.items() if name.endswith(end)), POSITION)


def same(before, after, most):
    if isinstance(before, list):
        return all(same(*pair, most) for pair in zip(before, after, strict=True))
    if isinstance(before, float) and isinstance(after, float):
        return abs(after - before) <= most * (1.0 + abs(before)) or before == after
    return before == after


def told(event):
    return event.tick, event.kind, event.id, event.code, event.category
