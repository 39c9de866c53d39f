"""A motion that the blocking client's arm returns."""

from typing import Self

from tvist_client import motion as asynchronous_motion
from tvist_client.portal import Portal
from tvist_protocol.stream import Event


class Motion:
    """One motion; see `tvist_client.motion.Motion`."""

    def __init__(self, portal: Portal, motion: asynchronous_motion.Motion) -> None:
        self._portal = portal
        self._motion = motion

    @property
    def id(self) -> int:
        """The robot's number for the motion."""
        return self._motion.id

    @property
    def started(self) -> int | None:
        """Tick at which it began; None until then."""
        return self._motion.started

    @property
    def done(self) -> int | None:
        """Tick at which it came to rest at the target; None until then, or if it never did."""
        return self._motion.done

    @property
    def stopped(self) -> Event | None:
        """The event that reports its end before the target; None if there is none."""
        return self._motion.stopped

    @property
    def ended(self) -> bool:
        """True once the motion has ended."""
        return self._motion.ended

    def wait(self) -> Self:
        """Wait for the end; raise MotionStoppedError if it came before the target."""
        self._portal.call(self._motion.wait)
        return self
