"""Plans for commands that take longer than a tick can wait, and which commands these are."""

from dataclasses import dataclass

from tvist_controller.planning.basis import (
    FilterBasis,
    MotionBasis,
    PlanBasis,
    ScriptBasis,
    StatementBasis,
    ToolBasis,
)
from tvist_controller.planning.filter_planner import PlannedFilter
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.refusal import RefusalError
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_protocol.programs import ProgramInterpret, ProgramLoad, ProgramRun
from tvist_protocol.replies import Posture, ToolPose
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.base import Filter
from tvist_urscript import Script

MOTIONS = (c.MoveJ, MoveL, MoveC, MovePath)
"""Commands for motions, which are planned on the state at rest."""
QUESTIONS = (InverseKinematics, ForwardKinematics)
"""Questions about the tool's kinematics."""
SCRIPTS = (ProgramLoad, ProgramRun, ProgramInterpret)
"""Commands with the text of a program, which is compiled."""
PLANNED = (*MOTIONS, *QUESTIONS, *SCRIPTS, c.SetShaper, c.SetEstimator, c.SetPayload, SimulationReset)
"""Commands that are planned."""

Found = PlannedMove | PlannedFilter | Filter | Posture | ToolPose | Script | None
"""What a plan may contain; None if nothing has to change."""


Basis = FilterBasis | MotionBasis | ToolBasis | ScriptBasis | StatementBasis
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
            case StatementBasis() as planned:
                return planned.after is now.statement.after
            case FilterBasis() as planned:
                return planned == now.filter
            case ToolBasis() as planned:
                return planned.tcp == now.tool.tcp
            case planned:
                return now.motion is not None and planned.agrees(now.motion)
