"""Plans for commands that take longer than a tick can wait, and how they are made."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from tvist_controller.commands.refusal import RefusalError
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
from tvist_protocol.replies import Posture, ToolPose
from tvist_shaping.base import Filter
from tvist_urscript import Script

Found = PlannedMove | PlannedFilter | Filter | Posture | ToolPose | Script | None
"""What a plan may contain; None if nothing has to change."""


Basis = FilterBasis | MotionBasis | ToolBasis | ScriptBasis | StatementBasis
"""State that a plan was made on."""


class Planning(NamedTuple):
    """How one type of command is planned."""

    on: Literal["filter", "motion", "tool", "script", "statement"]
    """Field of `PlanBasis` with the state that the plan depends on. If it is None, nothing is planned."""
    by: type
    """Class of the planner, of which a `Planner` has one object."""
    make: Callable[[Any, Any, Any], Found]
    """Returns the plan; takes the planner, the command and the state. It raises `RefusalError`."""
    within_tick: Callable[[Any, Any, Any], Found] | None = None
    """Makes a plan that may be worse but takes no longer than a tick can wait; None if `make` is all there is."""


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
