"""The one way to a plan for whatever is carried out in the ticks of a robot: now, or later beside the ticks."""

from collections.abc import Callable
from typing import Any, Protocol

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.planning.basis import MotionBasis, PlanBasis
from tvist_controller.planning.plan import Plan
from tvist_protocol.commands import Command

Order = Callable[[Command, PlanBasis], Callable[[], Plan]]
"""Has a command planned on a state; returns what waits for the plan."""


class MakesPlans(Protocol):
    """A `Planner`, which lies above all that uses plans."""

    def plan(
        self, command: Command, basis: PlanBasis, *, within_tick: bool = False, checked: bool = False
    ) -> Plan:
        """Plan a command on a state."""


class Plans:
    """Plans of one robot, for the commands of clients and of programs.

    Args:
        planner: Plans in the ticks.
        basis: Returns the present state that plans depend on; for a time, that of a motion that goes on from the
            running one, which stays as it is for this time [s].
        order: Has commands planned beside the ticks; None to plan them in the tick that needs the plan.
    """

    def __init__(
        self, planner: MakesPlans, basis: Callable[[float | None], PlanBasis], order: Order | None = None
    ) -> None:
        self._planner, self._basis = planner, basis
        self._order = order or (lambda command, on: lambda: planner.plan(command, on))

    def now(self, command: Command, *, within_tick: bool = False) -> Plan:
        """Plan a command on the present state; see `Planner.plan`."""
        return self._planner.plan(command, self._basis(None), within_tick=within_tick)

    def later(self, command: Command) -> Callable[[], Plan]:
        """Have a command planned on the present state; returns what waits for the plan."""
        return self._order(command, self._basis(None))

    def further(self, command: Command, time: float) -> Callable[[], Plan] | None:
        """Have a path planned that goes on from the running motion; returns what waits for the plan.

        Args:
            command: The further parts of the path.
            time: Time from now on in which the running motion stays as it is [s].

        Returns:
            None if the running motion, if there is one, cannot go on.
        """
        basis = self._basis(time)
        return None if basis.motion is None else self._order(command, basis)

    def hold(self, plan: Plan) -> bool:
        """Return whether a plan that was made before is valid for the present state."""
        goes_on = isinstance(plan.basis, MotionBasis) and plan.basis.after is not None
        return plan.holds(self._basis(0.0 if goes_on else None))

    def found(self, command: Command, plan: Plan | None = None) -> Any:
        """Return what was planned for a command that has passed its row's check.

        Args:
            command: The command.
            plan: Plan that was made before and is used if it still holds; without one, a plan is made now.

        Raises:
            RefusalError: The command cannot be carried out.
        """
        if plan is None or not self.hold(plan):
            plan = self._planner.plan(command, self._basis(None), checked=True)
        found = plan.found
        if isinstance(found, RefusalError):
            raise found
        return found
