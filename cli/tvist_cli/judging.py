"""Measure how much a shaper reduces the vibration of a motion, as `tvist log analyze A B` does."""

from itertools import pairwise
from typing import TYPE_CHECKING

from msgspec.structs import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tvist_lab.recordings import Recording
    from tvist_protocol.stream import Truth
    from tvist_view.request_handler import MotionRecord, Verdict

LEAST_TRUTH_SHARE = 0.8
"""Share of ticks that must have a truth message for the truth to be used [-]; a busy machine loses some."""


def judge(without: "MotionRecord", shaped: "MotionRecord") -> "Verdict":
    """Compare a motion without and with a shaper, each recorded past its end; unknown values are None."""
    from tvist_lab.metrics.comparison import MotionChange, compare
    from tvist_lab.metrics.table import MeasuredRecording

    first, second = (MeasuredRecording.of(_recording(run)) for run in (without, shaped))
    motions = compare(first, second).motions
    change = motions[0].change if motions else MotionChange(None, None, None, None)
    return change.as_dict()


def _recording(run: "MotionRecord") -> "Recording":
    """Return a motion as columns of the truth, or of the sensor if too many truth messages were lost."""
    from tvist_lab.recordings.messages import recording_of_messages

    truths = sorted(run.truths, key=lambda truth: truth.tick)
    if len(truths) < LEAST_TRUTH_SHARE * len(run.states):
        return recording_of_messages(run.states, run.events)
    # The first and last states may lack a truth message.
    states = [state for state in run.states if truths[0].tick <= state.tick <= truths[-1].tick]
    between = [truth for first, second in pairwise(truths) for truth in _between(first, second)]
    return recording_of_messages(
        states, run.events, sorted([*truths, *between], key=lambda truth: truth.tick)
    )


def _between(first: "Truth", second: "Truth") -> "Iterator[Truth]":
    """Interpolate truth messages lost between two: a gap where acceleration falls fast would distort it."""
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
