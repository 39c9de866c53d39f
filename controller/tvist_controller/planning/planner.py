"""Plans for commands that take longer than a tick can wait."""

from dataclasses import dataclass

from tvist_controller.planning.basis import FilterBasis, MotionBasis, PlanBasis, ScriptBasis, ToolBasis
from tvist_controller.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.reachable import Reachable
from tvist_controller.planning.script_planner import ScriptPlanner
from tvist_controller.refusal import RefusalError, check_content, payload_of
from tvist_controller.setup import Setup
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_protocol.programs import ProgramLoad, ProgramRun
from tvist_protocol.replies import Posture, ToolPose
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.base import Filter
from tvist_urscript import Script

MOTIONS = (c.MoveJ, MoveL, MoveC, MovePath)
"""Commands for motions, which are planned on the state at rest."""
QUESTIONS = (InverseKinematics, ForwardKinematics)
"""Questions about the tool's kinematics."""
SCRIPTS = (ProgramLoad, ProgramRun)
"""Commands with the text of a program, which is compiled."""
PLANNED = (*MOTIONS, *QUESTIONS, *SCRIPTS, c.SetShaper, c.SetEstimator, c.SetPayload, SimulationReset)
"""Commands that are planned."""

Found = PlannedMove | PlannedFilter | Filter | Posture | ToolPose | Script | None
"""What a plan may contain; None if nothing has to change."""


Basis = FilterBasis | MotionBasis | ToolBasis | ScriptBasis
"""State that a plan was made on."""


@dataclass(frozen=True)
class Plan:
    """The outcome of a command, valid while the state that it was planned on holds."""

    basis: Basis | None
    """State that it was planned on; None if no point-to-point motion may begin."""
    found: Found | RefusalError
    """What was planned, or why the command is refused."""

    def holds(self, now: PlanBasis) -> bool:
        """Return whether the plan is valid for the present state."""
        match self.basis:
            case None:
                return now.motion is None
            case ScriptBasis():
                return True
            case FilterBasis() as planned:
                return planned == now.filter
            case ToolBasis() as planned:
                return planned.tcp == now.tool.tcp
            case planned:
                return now.motion is not None and planned.agrees(now.motion)


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
        self._scripts = ScriptPlanner(setup.description)
        self._paths = PathPlanner(setup, self.filters, self._moves, self._reachable)

    def rehearse(self) -> None:
        """Compile what plans use, before any is needed: it takes long where nothing is in numba's cache."""
        self._reachable.rehearse()
        self._paths.rehearse()
        self._scripts.rehearse()

    def plan(self, command: c.Command, basis: PlanBasis) -> Plan:
        """Plan a command; a refusal is a plan, too."""
        on: Basis | None = basis.filter
        if isinstance(command, MOTIONS):
            on = basis.motion
        elif isinstance(command, QUESTIONS):
            on = basis.tool
        elif isinstance(command, SCRIPTS):
            on = ScriptBasis()
        try:
            check_content(command, self._description)
            return Plan(on, self._find(command, on))
        except RefusalError as refusal:
            return Plan(on, refusal)

    def _find(self, command: c.Command, on: Basis | None) -> Found:
        match on:
            case MotionBasis() if isinstance(command, c.MoveJ):
                return self._moves.move(command, on)
            case MotionBasis() if isinstance(command, MoveL | MoveC | MovePath):
                return self._paths.plan(command, on)
            case ToolBasis() if isinstance(command, InverseKinematics):
                return self._reachable.posture(command, on)
            case ToolBasis() if isinstance(command, ForwardKinematics):
                return self._reachable.pose(command, on)
            case ScriptBasis() if isinstance(command, ProgramLoad | ProgramRun):
                return self._scripts.compile(command)
            case FilterBasis():
                return self._filter(command, on)
        return None

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
