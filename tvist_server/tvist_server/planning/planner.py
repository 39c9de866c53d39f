"""Plans for the commands that take longer than a tick may wait."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from tvist_protocol import commands as c
from tvist_protocol.values import Payload
from tvist_server.planning.basis import Basis, FilterBasis, MotionBasis
from tvist_server.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_server.planning.move_planner import MovePlanner, PlannedMove
from tvist_server.refusal import RefusalError
from tvist_server.setup import Setup
from tvist_shaping.base import Filter

T = TypeVar("T")

PLANNED = (c.MoveJ, c.SetShaper, c.SetEstimator, c.SetPayload, c.SimulationReset)
"""Commands that are planned."""


@dataclass(frozen=True)
class Plan:
    """What a command will do, as long as what it was planned on holds."""

    basis: FilterBasis | MotionBasis | None
    """None: that no point-to-point motion may begin."""
    found: PlannedMove | PlannedFilter | Filter | RefusalError | None
    """What was planned, or why it cannot be; None where there is nothing to change."""

    def holds(self, now: Basis) -> bool:
        """Whether what it was planned on is so now."""
        match self.basis:
            case None:
                return now.motion is None
            case FilterBasis() as planned:
                return planned == now.filter
            case planned:
                return now.motion is not None and planned.agrees(now.motion)


class Planner:
    """Plans for one robot. Equal commands on equal bases get equal plans: nothing is remembered.

    Args:
        setup: How the robot starts.
    """

    def __init__(self, setup: Setup) -> None:
        self.filters = FilterPlanner(setup)
        self._moves = MovePlanner(setup, self.filters)

    def plan(self, command: c.Command, basis: Basis) -> Plan:
        """Plan a command; that it is refused is a plan, too."""
        if isinstance(command, c.MoveJ):
            motion = basis.motion
            return Plan(
                motion, None if motion is None else _or_refusal(lambda: self._moves.move(command, motion))
            )
        return Plan(basis.filter, _or_refusal(lambda: self._filter(command, basis.filter)))

    def _filter(self, command: c.Command, on: FilterBasis) -> PlannedFilter | Filter | None:
        filters = self.filters
        match command:
            case c.SetShaper():
                return filters.choose(command.name, command.modes, on.source, on.declared, "name")
            case c.SetEstimator():
                return filters.estimate(command, on)
            case c.SetPayload():
                payload = Payload(mass=command.mass, com=command.com, inertia=command.inertia)
                return filters.with_payload(payload, on)
            case c.SimulationReset() if command.shaper is not None:
                return filters.choose(command.shaper, 1, on.source, on.declared)
        return None


def _or_refusal(plan: Callable[[], T]) -> T | RefusalError:
    try:
        return plan()
    except RefusalError as refusal:
        return refusal
