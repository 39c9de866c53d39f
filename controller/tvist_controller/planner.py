"""Planner of all commands that take longer than a tick can wait."""

from tvist_controller.planning.basis import (
    FilterBasis,
    MotionBasis,
    PlanBasis,
    ScriptBasis,
    StatementBasis,
    ToolBasis,
)
from tvist_controller.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_controller.planning.move_planner import MovePlanner
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import MOTIONS, QUESTIONS, SCRIPTS, Basis, Found, Plan
from tvist_controller.planning.reachable import Reachable
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.quiet.interior_point import rehearse
from tvist_controller.refusal import RefusalError, check_content, payload_of
from tvist_controller.setup import Setup
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_protocol.programs import ProgramInterpret, ProgramLoad, ProgramRun
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.base import Filter


class Planner:
    """Plans for one robot. It keeps no state: equal commands on equal bases get equal plans.

    Args:
        setup: Initial setup.
    """

    def __init__(self, setup: Setup) -> None:
        self._description = setup.description
        self.filters = FilterPlanner(setup)
        self._moves = MovePlanner(setup, self.filters)
        self._reachable = Reachable(setup.description)
        self._scripts = ScriptCompiler(setup.description)
        self._paths = PathPlanner(setup, self.filters, self._moves, self._reachable)

    def rehearse(self) -> None:
        """Compile what plans use, before any is needed: it takes long where nothing is in numba's cache."""
        self.rehearse_postures()
        self.rehearse_plans()

    def rehearse_postures(self) -> None:
        """Compile inverse kinematics."""
        self._reachable.rehearse()

    def rehearse_plans(self) -> None:
        """Compile what is not inverse kinematics."""
        rehearse()
        self._paths.rehearse()
        self._scripts.rehearse()

    def plan(self, command: c.Command, basis: PlanBasis, *, at_once: bool = False) -> Plan:
        """Plan a command; a refusal is a plan, too.

        Args:
            command: The command.
            basis: The present state.
            at_once: Whether the plan must be made within a tick; see `MovePlanner.move`.
        """
        on: Basis | None = basis.filter
        if isinstance(command, MOTIONS):
            on = basis.motion
        elif isinstance(command, QUESTIONS):
            on = basis.tool
        elif isinstance(command, ProgramInterpret):
            on = basis.statement
        elif isinstance(command, SCRIPTS):
            on = ScriptBasis()
        try:
            check_content(command, self._description)
            return Plan(on, self._find(command, on, at_once=at_once))
        except RefusalError as refusal:
            return Plan(on, refusal)

    def _find(self, command: c.Command, on: Basis | None, *, at_once: bool) -> Found:
        found: Found = None
        match on:
            case MotionBasis() if isinstance(command, c.MoveJ):
                found = self._moves.move(command, on, at_once=at_once)
            case MotionBasis() if isinstance(command, MoveL | MoveC | MovePath):
                found = self._paths.plan(command, on)
            case ToolBasis() if isinstance(command, InverseKinematics):
                found = self._reachable.posture(command, on)
            case ToolBasis() if isinstance(command, ForwardKinematics):
                found = self._reachable.pose(command, on)
            case ScriptBasis() if isinstance(command, ProgramLoad | ProgramRun):
                found = self._scripts.compile(command)
            case StatementBasis() if isinstance(command, ProgramInterpret):
                found = self._scripts.compile_statement(command.text, on.after)
            case FilterBasis():
                found = self._filter(command, on)
        return found

    def _filter(self, command: c.Command, on: FilterBasis) -> PlannedFilter | Filter | None:
        filters = self.filters
        match command:
            case c.SetShaper():
                return filters.choose(command.name, command.modes, on.source, on.declared, "name")
            case c.SetEstimator():
                return filters.estimate(command, on)
            case c.SetPayload():
                return filters.with_payload(payload_of(command), on)
            case SimulationReset() if command.shaper is not None:
                return filters.choose(command.shaper, 1, on.source, on.declared)
        return None
