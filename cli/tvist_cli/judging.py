"""How much less a motion shakes with a shaper, by the same measure as `tvist log analyze A B`."""

from itertools import pairwise
from typing import TYPE_CHECKING

from msgspec.structs import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tvist_lab.recordings import Recording
    from tvist_protocol.stream import Truth
    from tvist_view.beside import Run, Verdict

MOST = 0.8
"""Share of the ticks whose truth must have come for it to be used: a busy machine loses some [-]."""


def judge(without: "Run", shaped: "Run") -> "Verdict":
    """Measure one motion without and with a shaper, each with the rest after it; what it lacks is None."""
    from tvist_lab.change import Change
    from tvist_lab.metrics.comparison import compare
    from tvist_lab.metrics.table import Measured

    first, second = (Measured.of(_recording(run)) for run in (without, shaped))
    motions = compare(first, second).motions
    change = motions[0].change if motions else Change(None, None, None, None)
    return change.as_dict()


def _recording(run: "Run") -> "Recording":
    """One motion as columns, by the truth, or by the sensor where few truths have come."""
    from tvist_lab.recordings.messages import recording_of_messages

    truths = sorted(run.truths, key=lambda truth: truth.tick)
    if len(truths) < MOST * len(run.states):
        return recording_of_messages(run.states, run.events)
    # At both ends a state may have come without its truth.
    states = [state for state in run.states if truths[0].tick <= state.tick <= truths[-1].tick]
    between = [truth for first, second in pairwise(truths) for truth in _between(first, second)]
    return recording_of_messages(
        states, run.events, sorted([*truths, *between], key=lambda truth: truth.tick)
    )


def _between(first: "Truth", second: "Truth") -> "Iterator[Truth]":
    """What was lost between two truths, by a straight line: |α| falls steeply at a stop, so that a hole would show."""
    for tick in range(first.tick + 1, second.tick):
        share = (tick - first.tick) / (second.tick - first.tick)
        mixed = {
            name: [
                a + share * (b - a) for a, b in zip(getattr(first, name), getattr(second, name), strict=True)
            ]
            for name in ("tool_acceleration", "flange_pose")
        }
        yield replace(
            first,
            tick=tick,
            timestamp=first.timestamp + share * (second.timestamp - first.timestamp),
            **mixed,
        )
