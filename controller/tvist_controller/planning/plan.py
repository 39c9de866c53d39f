"""Plans for commands that take longer than a tick can wait: how they are made, and how long they hold."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from tvist_controller.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.snapshot import FilterState, Snapshot
from tvist_controller.refusal import RefusalError
from tvist_protocol.commands import Command
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.replies import Posture, ToolPose
from tvist_shaping.base import Filter
from tvist_urscript import Script

Found = PlannedMove | PlannedFilter | Filter | Posture | ToolPose | Script | None
"""What a plan may contain; None if nothing has to change."""


class Planning(NamedTuple):
    """How one type of command is planned."""

    needs: tuple[str, ...]
    """Fields of the snapshot that the plan depends on."""
    by: type
    """Class of the planner, of which a `Planner` has one object."""
    make: Callable[[Any, Any, Snapshot], Found]
    """Returns the plan; takes the planner, the command and the state. It raises `RefusalError`."""
    within_tick: Callable[[Any, Any, Snapshot], Found] | None = None
    """Makes a plan that may be worse but takes no longer than a tick can wait; None if `make` is all there is."""


class Plan(NamedTuple):
    """The outcome of a command, valid while the state that it was planned on holds."""

    state: Mapping[str, Any]
    """Fields of the snapshot that it depends on, with their values."""
    found: Found | RefusalError
    """What was planned, or why the command is refused; None if no motion may begin."""
    until: float = 0.0
    """See `Snapshot.until`."""


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple):  # of arrays, perhaps, whose number changes while a payload is phased in
        return len(one) == len(other) and all(map(_same, one, other))
    return one is other or one == other


Order = Callable[[Command, Snapshot], Callable[[], Plan]]
"""Has a command planned on a state; returns what waits for the plan."""


class MakesPlans(Protocol):
    """A `Planner`, which lies above all that uses plans."""

    filters: FilterPlanner

    def for_lesson(self, lesson: PayloadLesson, present: FilterState) -> "Plan":
        """Plan what the robot has learnt: the present filter for what it carries."""

    def plan(
        self, command: Command, now: Snapshot, *, within_tick: bool = False, checked: bool = False
    ) -> Plan:
        """Plan a command on a state."""


class Plans:
    """Plans of one robot, for the commands of clients and of programs: made now, or later beside the ticks.

    `plan` is `Planner.plan`. `snapshot` returns the present state; for a time, that of a motion that goes on from the
    running one, which stays as it is for this time [s]. `order` has commands planned beside the ticks; without it, the
    tick that needs a plan makes it.
    """

    def __init__(
        self,
        plan: Callable[..., Plan],
        snapshot: Callable[[float | None], Snapshot],
        order: Order | None = None,
    ) -> None:
        self._plan, self._snapshot = plan, snapshot
        self._order = order or (lambda command, now: lambda: plan(command, now))

    def now(self, command: Command, *, within_tick: bool = False) -> Plan:
        """Plan a command on the present state; see `Planner.plan`."""
        return self._plan(command, self._snapshot(None), within_tick=within_tick)

    def later(self, command: Command) -> Callable[[], Plan]:
        """Have a command planned on the present state; returns what waits for the plan."""
        return self._order(command, self._snapshot(None))

    def further(self, command: Command, time: float) -> Callable[[], Plan] | None:
        """Have a path planned that goes on from the running motion, as `later`; None if that cannot go on."""
        now = self._snapshot(time)
        return self._order(command, now) if now.movable else None

    def hold(self, plan: Plan) -> bool:
        """Return whether a plan that was made before is valid for the present state."""
        goes_on = plan.state.get("after") is not None
        now = self._snapshot(0.0 if goes_on else None)
        return plan.until >= now.until and all(
            _same(value, getattr(now, name)) for name, value in plan.state.items()
        )

    def found(self, command: Command, plan: Plan | None = None) -> Any:
        """Return what was planned for a command that is checked: the plan if it still holds, else one that is made now.

        Raises:
            RefusalError: The command cannot be carried out.
        """
        if plan is None or not self.hold(plan):
            plan = self._plan(command, self._snapshot(None), checked=True)
        found = plan.found
        if isinstance(found, RefusalError):
            raise found
        return found
