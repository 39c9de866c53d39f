"""Planner of all commands that take longer than a tick can wait."""

from typing import Any

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.planning.basis import FilterBasis, PlanBasis
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.move_planner import MovePlanner
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import Basis, Plan
from tvist_controller.planning.reachable import Reachable
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.setup import Setup
from tvist_protocol.commands import Command
from tvist_protocol.lessons import PayloadLesson


class Planner:
    """Plans for one robot. It keeps no state: equal commands on equal bases get equal plans.

    Args:
        setup: Initial setup.
    """

    def __init__(self, setup: Setup) -> None:
        self._description = setup.description
        self.filters = FilterPlanner(setup)
        moves = MovePlanner(setup, self.filters)
        self._reachable = Reachable(setup.description)
        self._scripts = ScriptCompiler(setup.description)
        self._paths = PathPlanner(setup, self.filters, moves, self._reachable)
        planners = (self.filters, moves, self._paths, self._reachable, self._scripts)
        self._planners: dict[type, Any] = {type(one): one for one in planners}

    def rehearse_scripts(self) -> None:
        """Make what compiling a program needs; that is Python alone, and may be done while a robot ticks."""
        self._scripts.rehearse()

    def for_lesson(self, lesson: PayloadLesson, basis: FilterBasis) -> Plan:
        """Plan what the robot has learnt: the present filter for what it carries."""
        try:
            return Plan(basis, self.filters.with_payload(lesson.payload, basis))
        except RefusalError as refusal:
            return Plan(basis, refusal)

    def plan(self, command: Command, basis: PlanBasis, *, within_tick: bool = False) -> Plan:
        """Plan a command; a refusal is a plan, too.

        Args:
            command: The command; its row says how it is planned.
            basis: The present state.
            within_tick: Whether the plan must be made within a tick; see `Planning.within_tick`.
        """
        row = COMMANDS[type(command)]
        assert row.plan is not None, "the command is carried out without a plan"
        on: Basis | None = getattr(basis, row.plan.on)
        make = row.plan.make
        if within_tick and row.plan.within_tick is not None:
            make = row.plan.within_tick
        try:
            if row.check is not None:
                row.check(command, self._description)
            return Plan(on, None if on is None else make(self._planners[row.plan.by], command, on))
        except RefusalError as refusal:
            return Plan(on, refusal)
