"""A command is a row: its message, what handles it, and what it takes."""

from collections.abc import Callable
from typing import Any, Generic, Literal, NamedTuple, TypeVar

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
    lease: Literal["needed", "if named", "none"] = "needed"
    """Whether its token must be that of the lease: always, where it has one, or never: it names something else."""
    changes_io: bool = False
    """True if the command may change what `io` reports."""
