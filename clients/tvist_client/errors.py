"""Errors that a client can raise.

TvistError
├── RefusedError             the robot refused a command, which changed nothing (of `tvist_protocol`)
├── ProtocolError            a value cannot be sent, such as a NaN or an invalid name (of `tvist_protocol`)
└── ClientError
    ├── NotConnectedError    no server or robot answers; also a ConnectionError
    ├── DeniedError          the certificate does not allow a command; also a PermissionError
    ├── AnswerTimeoutError   the robot is connected but does not answer; also a TimeoutError
    ├── StoppedError         the robot ended something, and gave the reason in an event
    │   ├── MotionStoppedError   a motion ended before its target
    │   ├── StreamStoppedError   the robot ended the stream of set-points
    │   └── ProtectiveStopError  an unlocked robot stopped again at once
    ├── ArgumentError        an argument is invalid; also a ValueError
    ├── UnexpectedReplyError the answer does not follow this protocol
    └── MisuseError          the call is not possible now
"""

from typing import ClassVar

from tvist_protocol import Event, TvistError


class ClientError(TvistError):
    """Base class of the client's own errors."""


class NotConnectedError(ClientError, ConnectionError):
    """No robot answers, or the connection was lost."""


class DeniedError(ClientError, PermissionError):
    """The robot takes no commands from this client, whose certificate is not an operator's."""


class AnswerTimeoutError(ClientError, TimeoutError):
    """The expected message did not arrive in time."""


class UnexpectedReplyError(ClientError):
    """An answer arrived that this client does not understand."""


class MisuseError(ClientError):
    """The call is not possible now; the message says what to do first."""


class ArgumentError(ClientError, ValueError):
    """An argument is invalid; nothing was sent.

    Attributes:
        where: Argument at fault, such as `q[3]`.
        why: Message with argument, value and what is allowed.
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
    """The robot ended something, and reported it in an event, which is `event`."""

    _what: ClassVar = "the robot stopped"

    def __init__(self, event: Event) -> None:
        super().__init__(event)
        self.event = event

    def __str__(self) -> str:
        why = f": {self.event.why}" if self.event.why else ""
        return f"{self._what.format(self.event.id)} at tick {self.event.tick}{why}"


class MotionStoppedError(StoppedError):
    """A motion ended before its target; the event is the robot's `motion_stopped`."""

    _what = "motion {} was stopped"


class StreamStoppedError(StoppedError):
    """The robot ended the stream of set-points; `servo` starts a new one. The event is the robot's `stream_stopped`."""

    _what = "the stream of set-points was ended"


class ProtectiveStopError(StoppedError):
    """An unlocked robot stopped again at once, because the cause persists; the event is its `protective_stop`."""

    _what = "the robot made another protective stop"
