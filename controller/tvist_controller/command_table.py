"""The table of commands: which handler carries out a command, and with which plan."""

from collections.abc import Callable, Iterable
from typing import Any

from tvist_controller.command_row import Call, Row
from tvist_controller.planner import Planner
from tvist_controller.planning.basis import PlanBasis
from tvist_controller.planning.plan import Plan
from tvist_controller.refusal import RefusalError
from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply

Order = Callable[[Command, PlanBasis], Callable[[], Plan]]
"""Has a command planned on a state; returns what waits for the plan."""


class CommandTable:
    """The commands of one robot.

    Args:
        planner: Plans them, where no plan comes with them.
        basis: Returns the present state that plans depend on.
    """

    def __init__(self, planner: Planner, basis: Callable[[], PlanBasis]) -> None:
        self._planner, self._basis = planner, basis
        self._rows: dict[type[Command], Row] = {}

    def add(self, rows: Iterable[Row]) -> None:
        """Add commands."""
        self._rows.update({row.message: row for row in rows})

    def row(self, command: Command) -> Row:
        """Return the row of a command."""
        return self._rows[type(command)]

    def plan(self, command: Command) -> Plan:
        """Plan a command on the present state."""
        return self._planner.plan(command, self._basis())

    def plan_at_once(self, command: Command) -> Plan:
        """Plan a command on the present state within a tick; see `MovePlanner.move`."""
        return self._planner.plan(command, self._basis(), at_once=True)

    def plan_later(self, command: Command, basis: PlanBasis) -> Callable[[], Plan]:
        """Return what plans a command on a state: an `Order` that needs no thread."""
        return lambda: self._planner.plan(command, basis)

    def carry_out(
        self,
        command: Command,
        tick: int,
        now: float,
        plan: Plan | None = None,
        session: str | None = None,
        origin: str | None = None,
    ) -> Reply | None:
        """Carry out a command between two ticks.

        Args:
            command: The command.
            tick: Number of the next control period.
            now: Time [s].
            plan: Plan for the command that holds, if it was made beforehand.
            session: Session of the client that gets control, if its end will be reported.
            origin: IP address of the machine that sent it, if known.

        Raises:
            RefusalError: It cannot be carried out, and has changed nothing.
        """

        def planned() -> Any:
            found = (plan or self.plan(command)).found
            if isinstance(found, RefusalError):
                raise found
            return found

        return self.row(command).handle(Call(command, tick, now, session, planned, origin))
