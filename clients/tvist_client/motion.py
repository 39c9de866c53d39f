"""Motions, as the robot's events tell of them."""

import asyncio
from collections.abc import Awaitable, Callable, Generator
from typing import Any

from tvist_client.errors import ClientError, MotionStoppedError
from tvist_protocol.stream import Event

REMEMBERED = 256
"""Motions of which the end is kept; an event may come before the answer that names its motion."""


class Motion:
    """One motion, from the robot's acceptance to its end.

    Attributes:
        id: The robot's number for it.
        started: Tick at which it began; None before.
        done: Tick at which its shaped reference came to rest at the target; None before, and where it never
            did.
        stopped: The event that says that it ended before its target; None where it did not.
    """

    def __init__(self, id: int, pass_time: Callable[["Motion"], Awaitable[None]]) -> None:  # noqa: A002  the wire's name
        self.id = id
        self.started: int | None = None
        self.done: int | None = None
        self.stopped: Event | None = None
        self._pass_time = pass_time
        self._error: ClientError | None = None
        self._ended = asyncio.Event()

    @property
    def ended(self) -> bool:
        """True once the motion has ended, or the connection that reports its end is lost."""
        return self._ended.is_set()

    async def wait(self) -> "Motion":
        """Wait for the end; in lockstep and free let time pass until it comes.

        Raises:
            MotionStoppedError: The motion ended before its target.
            NotConnectedError: The robot went away.
        """
        await self._pass_time(self)
        if self._error is not None:
            raise self._error
        if self.stopped is not None:
            raise MotionStoppedError(self.stopped)
        return self

    def __await__(self) -> Generator[Any, None, "Motion"]:
        """`await motion` is `await motion.wait()`."""
        return self.wait().__await__()

    async def wait_event(self) -> None:
        """Wait for the event of the end, without letting time pass."""
        await self._ended.wait()

    def on_event(self, event: Event) -> None:
        """Take an event that concerns this motion."""
        if event.kind == "motion_started":
            self.started = event.tick
        elif event.kind == "motion_done":
            self.done = event.tick
            self._ended.set()
        elif event.kind == "motion_stopped":
            self.stopped = event
            self._ended.set()

    def fail(self, error: ClientError) -> None:
        """Nothing more will be heard of it."""
        if not self.ended:
            self._error = error
            self._ended.set()


class MotionsByNumber:
    """The motions of one robot by number, known by their answer or by an event, whichever comes first.

    Args:
        pass_time: Lets time pass until a motion has ended.
    """

    def __init__(self, pass_time: Callable[[Motion], Awaitable[None]]) -> None:
        self._pass_time = pass_time
        self._motions: dict[int, Motion] = {}

    def motion(self, id: int) -> Motion:  # noqa: A002  the wire's name
        """The motion of that number."""
        motion = self._motions.get(id)
        if motion is None:
            motion = self._motions[id] = Motion(id, self._pass_time)
            if len(self._motions) > REMEMBERED:
                del self._motions[next(iter(self._motions))]
        return motion

    def on_event(self, event: Event) -> None:
        """Take any event."""
        if event.id is not None:
            self.motion(event.id).on_event(event)

    def fail(self, error: ClientError) -> None:
        """Nothing more will be heard of any; a robot that comes back may count anew."""
        for motion in self._motions.values():
            motion.fail(error)
        self._motions.clear()
