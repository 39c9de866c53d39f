"""As a client, move a robot to the place of a measurement, and collect its messages."""

from collections.abc import Awaitable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_client.robot import Robot
from tvist_lab.recordings import Floats, Recording
from tvist_protocol.errors import RefusedError
from tvist_protocol.stream import Event, State, Truth

Result = TypeVar("Result")


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


async def unless_collision(measuring: Awaitable[Result]) -> Result | None:
    """Await a motion or measurement; return None if the robot refuses it because of a collision."""
    try:
        return await measuring
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None


async def reach(arm: Arm, q: Floats) -> Motion:
    """Move to a configuration; if the straight line collides, move via the upright arm.

    Raises RefusedError with code `collision` if the way via the upright arm collides, too.
    """
    if (there := await unless_collision(arm.move_j(q))) is not None:
        return there
    upright = np.zeros_like(q)
    upright[[joint for joint in (1, 3) if joint < len(q)]] = -np.pi / 2
    await arm.move_j(upright)
    return await arm.move_j(q)
