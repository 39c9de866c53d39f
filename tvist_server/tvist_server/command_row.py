"""A command is a row: its message, what handles it, and what it takes."""

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply

C = TypeVar("C", bound=Command)


class Call(NamedTuple, Generic[C]):
    """A command as it is carried out between two ticks."""

    command: C
    tick: int
    """Number of the next control period."""
    now: float
    """Time [s]; it passes by ticks alone."""
    session: str | None
    """Session of the client that the command gives control to, where its going will be told."""
    planned: Callable[[], Any]
    """Gives what was planned for the command, or plans it; raises `RefusalError` where it cannot be done."""


class Row(NamedTuple):
    """How a controller carries out one type of command.

    A handler stands beside what it changes. It raises `RefusalError`, or `NoControlError`, before it has changed
    anything; where it returns nothing, the reply is `Done`.
    """

    message: type[Command]
    handle: Callable[[Call[Any]], Reply | None]
    needs_lease: bool = True
    """False: anyone may send it; a token that is there all the same must be that of the lease."""
    changes_io: bool = False
    """Whether it may change what `io` tells."""
