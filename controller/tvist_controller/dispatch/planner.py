"""Planner of all commands that take too long for a tick."""

from typing import Any

from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.kinematic_planner import KinematicPlanner
from tvist_controller.planning.move_planner import MovePlanner
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import Plan, PlanResult
from tvist_controller.planning.snapshot import FilterState, PlanningState
from tvist_controller.planning.trajectory_planner import TrajectoryPlanner
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup
from tvist_protocol.commands import Command
from tvist_protocol.lessons import PayloadLesson


class Planner:
    """Stateless plans for one robot: equal commands in equal states get equal plans."""

    def __init__(self, setup: Setup) -> None:
        self._description = setup.description
        self.filters = FilterPlanner(setup)
        moves, kinematic = MovePlanner(setup, self.filters), KinematicPlanner(setup.description)
        self._scripts = ScriptCompiler(setup.description)
        paths = PathPlanner(setup, self.filters, moves, kinematic)
        trajectories = TrajectoryPlanner(setup, self.filters, moves)
        planners = (self.filters, moves, paths, trajectories, kinematic, self._scripts)
        self._planners: dict[type, Any] = {type(one): one for one in planners}

    def rehearse_scripts(self) -> None:
        """Prepare the compiler of programs, in pure Python, while a robot ticks."""
        self._scripts.rehearse()

    def for_lesson(self, lesson: PayloadLesson, present: FilterState) -> Plan:
        """Plan the present filter for a payload that the robot has learnt."""
        found: PlanResult | RefusalError
        try:
            found = self.filters.with_payload(lesson.payload, present)
        except RefusalError as refusal:
            found = refusal
        return Plan({"filter": present}, found)

    def plan(
        self, command: Command, now: PlanningState, *, within_tick: bool = False, checked: bool = False
    ) -> Plan:
        """Plan a command, or refuse it, in the state `now`; `checked`: it has passed the check of its row."""
        row = COMMANDS[type(command)]
        planning = row.plan
        assert planning is not None, "the command is carried out without a plan"
        possible = now.movable or "movable" not in planning.needs
        make = (within_tick and planning.within_tick) or planning.make
        found: PlanResult | RefusalError
        try:
            if row.check is not None and not checked:
                row.check(command, self._description)
            found = make(self._planners[planning.by], command, now) if possible else None
        except RefusalError as refusal:
            found = refusal
        state = {name: getattr(now, name) for name in (planning.needs if possible else ("movable",))}
        return Plan(state, found, now.until)
