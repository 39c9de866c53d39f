"""Rows of the table of commands: message, handler and requirements."""

from collections.abc import Callable
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply

C = TypeVar("C", bound=Command)


class Call(NamedTuple, Generic[C]):
    """A command that is being carried out between two ticks."""

    command: C
    tick: int
    """Number of the next control period."""
    now: float
    """Time [s], which only ticks advance."""
    session: str | None
    """Session of the client that the command gives control to, if `client_gone` will report its end."""
    planned: Callable[[], Any]
    """Returns the plan for the command, making it if necessary; raises `RefusalError` if it cannot be carried out."""
    origin: str | None = None
    """IP address of the machine that sent the command; None if the network does not tell."""


class Row(NamedTuple):
    """How a controller carries out one type of command.

    The handler is defined next to the state that it changes. It raises `RefusalError` or `NoControlError` before it
    changes anything; if it returns nothing, the reply is `Done`.
    """

    message: type[Command]
    handle: Callable[[Call[Any]], Reply | None]
    lease: Literal["needed", "if named", "none"] = "needed"
    """When the command's token must be that of the lease: always, if it has one, or never, since it means something
    else.
    """
    changes_io: bool = False
    """True if the command may change what `io` reports."""
