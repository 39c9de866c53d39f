"""Motions, as the robot's events report them."""

import asyncio
from collections.abc import Awaitable, Callable, Generator
from typing import Any, Self

from tvist_client.errors import ClientError, MotionStoppedError
from tvist_protocol.stream import Event

REMEMBERED = 256
"""Number of ended motions that are kept, because an event may precede the answer that names its motion."""


class Motion:
    """One motion, from the robot's acceptance to its end."""

    id: int
    """The robot's number of the motion."""
    started: int | None = None
    """Tick at which it started; None until then."""
    done: int | None = None
    """Tick at which its shaped reference came to rest at the target; None until then, or if it never did."""
    limited: str | None = None
    """Why it is slower than requested, or which limit it will exceed; None if it is as requested."""
    stopped: Event | None = None
    """Event that reports its end before the target; None if there is none."""

    def __init__(self, id: int, pass_time: Callable[["Motion"], Awaitable[None]]) -> None:  # noqa: A002  the wire's name
        self.id, self._pass_time = id, pass_time
        self._error: ClientError | None = None
        self._ended = asyncio.Event()

    @property
    def ended(self) -> bool:
        """Whether the motion has ended, or the connection that would report its end is lost."""
        return self._ended.is_set()

    async def wait(self) -> Self:
        """Wait for the end; in lockstep and free, step time until then.

        Raises:
            MotionStoppedError: The motion ended before its target.
            NotConnectedError: The robot disconnected.
        """
        await self._pass_time(self)
        if self._error is not None:
            raise self._error
        if self.stopped is not None:
            raise MotionStoppedError(self.stopped)
        return self

    def __await__(self) -> Generator[Any, None, Self]:
        return self.wait().__await__()

    async def wait_event(self) -> None:
        """Wait for the event of the end, without stepping time."""
        await self._ended.wait()

    def on_event(self, event: Event) -> None:
        """Take an event that concerns this motion."""
        if event.kind == "motion_started":
            self.started = event.tick
        elif event.kind == "motion_done":
            self.done = event.tick
        elif event.kind == "motion_stopped":
            self.stopped = event
        if self.done is not None or self.stopped is not None:
            self._ended.set()

    def fail(self, error: ClientError) -> None:
        """Note that no further events of the motion will arrive, because of this error."""
        if not self.ended:
            self._error = error
            self._ended.set()


class MotionsByNumber:
    """A robot's motions by number. The answer or the first event, whichever comes first, creates a motion."""

    def __init__(self, pass_time: Callable[[Motion], Awaitable[None]]) -> None:
        self._pass_time, self._motions = pass_time, dict[int, Motion]()

    def motion(self, id: int) -> Motion:  # noqa: A002  the wire's name
        """Return the motion with this number; create it if neither an answer nor an event has named it yet."""
        motion = self._motions.get(id)
        if motion is None:
            motion = self._motions[id] = Motion(id, self._pass_time)
            if len(self._motions) > REMEMBERED:
                del self._motions[next(iter(self._motions))]
        return motion

    def on_event(self, event: Event) -> None:
        """Pass an event on to the motion that it names."""
        if event.id is not None:
            self.motion(event.id).on_event(event)

    def fail(self, error: ClientError) -> None:
        """Note that no further events will arrive; when the robot reconnects, its numbers may restart."""
        for motion in self._motions.values():
            motion.fail(error)
        self._motions.clear()
