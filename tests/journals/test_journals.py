"""What robots did once they do again: runs recorded earlier, replayed by the controller as it is now.

A difference is either an error or a deliberate change of what a robot does. After the latter the runs are made anew by
`make.py` and `thin.py`, and CHANGELOG says what is different.
"""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.journals.thin import MADE_ON, processor

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import known_fields, replay_file
from tvist_protocol.recorded import THIS_BEHAVIOUR

RUNS = sorted(Path(__file__).parent.glob("*.mcap"))
ROUNDING = 1e-6
"""What another processor may make different in a value of about one, in SI units; what a robot does differs by more."""
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
            assert same(before, after), f"tick {recorded.tick}: {name} was {before}, is {after}"
    assert list(map(told, again.events)) == list(map(told, content.events))


def test_a_run_of_another_behaviour_says_so():
    again = replay_file(replace(read(RUNS[0]), behaviour=1))
    assert any(f"is of behaviour 1, and this is {THIS_BEHAVIOUR}" in note for note in again.notes)


def same(before, after):
    if isinstance(before, list):
        return len(before) == len(after) and all(map(same, before, after))
    if isinstance(before, float) and isinstance(after, float):
        return before == after if AS_MADE else abs(after - before) <= ROUNDING * (1.0 + abs(before))
    return before == after


def told(event):
    return event.tick, event.kind, event.id, event.code, event.category
