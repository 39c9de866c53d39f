"""Collect all messages of a robot while a block runs."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from tvist_client.robot import Robot
from tvist_lab.recordings import Recording
from tvist_protocol.stream import Event, State, Truth


@dataclass
class Collected:
    """States, events and truths in the order of arrival."""

    states: list[State] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    truths: list[Truth] = field(default_factory=list)

    def recording(self) -> Recording:
        """Return the messages as columns; with truths, from the first to the last tick that has a truth."""
        # On a network the truth of a tick may come before or after its state.
        from tvist_lab.recordings.messages import recording_of_messages

        states = self.states
        if self.truths:
            first, last = self.truths[0].tick, self.truths[-1].tick
            states = [state for state in states if first <= state.tick <= last]
        return recording_of_messages(states, self.events, self.truths)


@contextmanager
def collect(robot: Robot) -> Iterator[Collected]:
    """Collect all messages of the robot while the block runs."""
    collected = Collected()
    ends = [
        robot.on_state(collected.states.append),
        robot.on_event(collected.events.append),
        robot.on_truth(collected.truths.append),
    ]
    try:
        yield collected
    finally:
        for end in ends:
            end()
