"""Plans for commands that take longer than a tick can wait."""

from dataclasses import dataclass

from tvist_controller.planning.basis import FilterBasis, MotionBasis, PlanBasis
from tvist_controller.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.refusal import RefusalError, check_content, payload_of
from tvist_controller.setup import Setup
from tvist_protocol import commands as c
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.base import Filter

PLANNED = (c.MoveJ, MoveL, MoveC, MovePath, c.SetShaper, c.SetEstimator, c.SetPayload, SimulationReset)
"""Commands that are planned."""
MOTIONS = (c.MoveJ, MoveL, MoveC, MovePath)
"""Those of them that are planned on the state at rest."""


@dataclass(frozen=True)
class Plan:
    """The outcome of a command, valid while the state that it was planned on holds."""

    basis: FilterBasis | MotionBasis | None
    """State that it was planned on; None if no point-to-point motion may begin."""
    found: PlannedMove | PlannedFilter | Filter | RefusalError | None
    """What was planned, or why the command is refused; None if nothing has to change."""

    def holds(self, now: PlanBasis) -> bool:
        """Return whether the plan is valid for the present state."""
        match self.basis:
            case None:
                return now.motion is None
            case FilterBasis() as planned:
                return planned == now.filter
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
        self._paths = PathPlanner(setup, self.filters, self._moves)

    def plan(self, command: c.Command, basis: PlanBasis) -> Plan:
        """Plan a command; a refusal is a plan, too."""
        on = basis.motion if isinstance(command, MOTIONS) else basis.filter
        try:
            return Plan(on, self._find(command, basis))
        except RefusalError as refusal:
            return Plan(on, refusal)

    def _motion(self, command: c.MoveJ | MoveL | MoveC | MovePath, basis: MotionBasis) -> PlannedMove:
        if isinstance(command, c.MoveJ):
            return self._moves.move(command, basis)
        return self._paths.plan(command, basis)

    def _find(self, command: c.Command, basis: PlanBasis) -> PlannedMove | PlannedFilter | Filter | None:
        check_content(command, self._description)
        on, filters = basis.filter, self.filters
        match command:
            case c.MoveJ() | MoveL() | MoveC() | MovePath():
                return None if basis.motion is None else self._motion(command, basis.motion)
            case c.SetShaper():
                return filters.choose(command.name, command.modes, on.source, on.declared, "name")
            case c.SetEstimator():
                return filters.estimate(command, on)
            case c.SetPayload():
                return filters.with_payload(payload_of(command), on)
            case SimulationReset() if command.shaper is not None:
                return filters.choose(command.shaper, 1, on.source, on.declared)
        return None
