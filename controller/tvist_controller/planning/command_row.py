"""Rows of the table of commands: all that is true of one type of command, with the handler that carries it out."""

from collections.abc import Callable
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import TOOL
from tvist_plant.description import RobotDescription
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
    """One type of command: how a controller carries it out, and what this needs.

    Which commands let the arm move, and in which activity each may be given, is not said here but in the protocol's
    table of transitions.
    """

    message: type[Command]
    handle: Callable[[Any, Call[Any]], Reply | None]
    """Carries it out on a `Robot`. The content has been checked before. It raises `RefusalError` or `NoControlError`
    before it changes anything; if it returns nothing, the reply is `Done`.
    """
    lease: Literal["needed", "if named", "none"] = "needed"
    """When the command's token must be that of the lease: always, if it has one, or never, since it means something
    else.
    """
    changes_io: bool = False
    """True if the command may change what `io` reports."""
    check: Callable[[Any, RobotDescription], None] | None = None
    """Refuses a command that such a robot cannot carry out in any state; None if the types of its fields suffice."""
    plan: Planning | None = None
    """How it is planned; None if carrying it out takes no longer than a tick can wait."""
    long: bool = False
    """Whether the message may be longer than `EXPLAINED_BYTES`."""
    stops: bool = False
    """Whether it stops the arm, so that it waits for no plan of a command before it."""

    @property
    def asks(self) -> bool:
        """Whether it is a question about the tool's kinematics, which changes nothing."""
        return self.plan is not None and self.plan.needs is TOOL
