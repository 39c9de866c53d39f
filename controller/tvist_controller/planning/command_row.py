"""Rows of the command table: properties of a command type and its handler."""

from collections.abc import Callable
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import TOOL
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply

C = TypeVar("C", bound=Command)


class CommandCall(NamedTuple, Generic[C]):
    """A command being carried out between two ticks."""

    command: C
    tick: int  # number of the next control period
    now: float  # time; only ticks advance it [s]
    session: str | None  # session of the client that gets control, if `client_gone` will report its end
    planned: Callable[[], Any]
    """Returns the plan, making it if necessary; raises `RefusalError` if the command is impossible."""
    origin: str | None = None  # IP address of the sender; None if unknown


class CommandRow(NamedTuple):
    """One type of command: how a controller carries it out, and what that needs.

    The protocol's table of transitions defines which commands move the arm, and when each is allowed.
    """

    message: type[Command]
    handle: Callable[[Any, CommandCall[Any]], Reply | None]
    """Carries out a checked command on a `Robot`. Raises `RefusalError` or `NoControlError` before any
    change; None means the reply `Done`."""
    lease: Literal["needed", "if named", "none"] = "needed"
    """When the command's token must be that of the lease: always, if present, or never, because it has
    another meaning."""
    changes_io: bool = False  # whether the command may change what `io` reports
    check: Callable[[Any, RobotDescription], None] | None = None
    """Refuses a command that this robot can never carry out; None if the types of the fields suffice."""
    plan: Planning | None = None  # how it is planned; None if it is quick enough for a tick
    long: bool = False  # whether the message may be longer than `EXPLAINED_BYTES`
    stops: bool = False  # whether it stops the arm and so must not wait for earlier plans

    @property
    def asks(self) -> bool:
        """Whether it only queries the tool's kinematics."""
        return self.plan is not None and self.plan.needs is TOOL
