"""What can go wrong at a client, and what to do about it.

TvistError
├── RefusedError             the robot refused a command, which changed nothing (of `tvist_protocol`)
├── ProtocolError            a value cannot be sent: no number, no name (of `tvist_protocol`)
└── ClientError
    ├── NotConnectedError    no server or robot answers; also a ConnectionError
    ├── AnswerTimeoutError   the robot is connected but does not answer; also a TimeoutError
    ├── StoppedError         the robot ended something, and told why in an event
    │   ├── MotionStoppedError   a motion ended before its target
    │   ├── StreamStoppedError   the robot ended the stream of set-points
    │   └── ProtectiveStopError  an unlocked robot stopped again at once
    ├── ArgumentError        an argument is no value of its kind; also a ValueError
    ├── UnexpectedReplyError the answer is not one of this protocol
    └── MisuseError          called when it makes no sense
"""

from tvist_protocol.errors import TvistError
from tvist_protocol.stream import Event


class ClientError(TvistError):
    """Root of what a client raises of its own."""


class NotConnectedError(ClientError, ConnectionError):
    """There is no robot to talk to, or it has gone."""


class AnswerTimeoutError(ClientError, TimeoutError):
    """What was waited for did not come in time."""


class UnexpectedReplyError(ClientError):
    """An answer came that this client does not understand."""


class MisuseError(ClientError):
    """A call that is not possible now; the message says what to do first."""


class ArgumentError(ClientError, ValueError):
    """An argument that cannot be meant: nothing was sent.

    Attributes:
        where: Argument at fault, such as `q[3]`.
        why: A sentence with argument, value and what is allowed.
        limit: Limit that was exceeded, in the argument's unit; None if there is none.
    """

    def __init__(self, where: str, why: str, limit: float | None = None) -> None:
        super().__init__(where, why, limit)
        self.where = where
        self.why = why
        self.limit = limit

    def __str__(self) -> str:
        return self.why


class StoppedError(ClientError):
    """The robot ended something, and told of it in an event.

    Attributes:
        event: The event.
    """

    def __init__(self, event: Event) -> None:
        super().__init__(event)
        self.event = event

    def __str__(self) -> str:
        why = f": {self.event.why}" if self.event.why else ""
        return f"{self._what} at tick {self.event.tick}{why}"

    @property
    def _what(self) -> str:
        return "the robot stopped"


class MotionStoppedError(StoppedError):
    """A motion ended before its target; the event is the robot's `motion_stopped`."""

    @property
    def _what(self) -> str:
        return f"motion {self.event.id} was stopped"


class StreamStoppedError(StoppedError):
    """The robot ended the stream of set-points; `servo` begins a new one. The event is its `stream_stopped`."""

    @property
    def _what(self) -> str:
        return "the stream of set-points was ended"


class ProtectiveStopError(StoppedError):
    """A robot that was unlocked stopped again at once: what made it stop is still there.

    The event is its `protective_stop`.
    """

    @property
    def _what(self) -> str:
        return "the robot made another protective stop"
