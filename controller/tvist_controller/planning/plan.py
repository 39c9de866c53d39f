"""Rows of the command table; creation and validity of plans for commands that take too long for a tick."""

from collections.abc import Callable, Mapping
from typing import Any, Generic, Literal, NamedTuple, Protocol, TypeVar

import numpy as np

from tvist_controller.planning.filter_planner import FilterChoice, FilterPlanner
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.snapshot import TOOL, FilterState, PlanningState
from tvist_controller.refusal import RefusalError
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Command
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.replies import Posture, Reply, ToolPose
from tvist_shaping.base import Filter
from tvist_urscript import Script

PlanResult = PlannedMove | FilterChoice | Filter | Posture | ToolPose | Script | None
"""Possible results of a plan; None if nothing changes."""


class Planning(NamedTuple):
    """How a type of command is planned."""

    needs: tuple[str, ...]  # fields of the snapshot that the plan depends on
    by: type  # class of the planner; a `Planner` has one instance
    make: Callable[[Any, Any, PlanningState], PlanResult]
    """Returns the plan for planner, command and state; raises `RefusalError`."""
    within_tick: Callable[[Any, Any, PlanningState], PlanResult] | None = None
    """Makes a possibly worse plan quickly enough for a tick; None if there is only `make`."""


class Plan(NamedTuple):
    """Result of planning a command, valid while the state that the plan depends on stays equal."""

    state: Mapping[str, Any]  # fields of the snapshot that the plan depends on
    found: PlanResult | RefusalError  # what was planned, or the refusal; None if no motion may start
    until: float = 0.0  # see `PlanningState.until`


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple):  # may contain arrays, whose number changes while a payload is phased in
        return len(one) == len(other) and all(map(_same, one, other))
    return one is other or one == other


Order = Callable[[Command, PlanningState], Callable[[], Plan]]
"""Orders a plan on a state; returns a function that waits for it."""


class PlannerLike(Protocol):
    """Interface of `Planner`, which is in a higher layer than users of plans."""

    filters: FilterPlanner

    def for_lesson(self, lesson: PayloadLesson, present: FilterState) -> "Plan":
        """Plan the present filter for a payload that the robot has learnt."""

    def plan(
        self, command: Command, now: PlanningState, *, within_tick: bool = False, checked: bool = False
    ) -> Plan:
        """Plan a command on a state."""


class Plans:
    """Makes the plans of one robot, now or outside the ticks, for commands of clients and programs.

    `plan` is `Planner.plan`. `snapshot` returns the present state or, with a time [s], that of a motion that continues
    the running one after this time. `order` plans outside the ticks; without it, the tick that needs a plan makes it.
    """

    def __init__(
        self,
        plan: Callable[..., Plan],
        snapshot: Callable[[float | None], PlanningState],
        order: Order | None = None,
    ) -> None:
        self._plan, self._snapshot = plan, snapshot
        self._order = order or (lambda command, now: lambda: plan(command, now))

    def now(self, command: Command, *, within_tick: bool = False) -> Plan:
        """Plan a command on the present state; see `Planner.plan`."""
        return self._plan(command, self._snapshot(None), within_tick=within_tick)

    def later(self, command: Command) -> Callable[[], Plan]:
        """Order a plan on the present state; return a function that waits for it."""
        return self._order(command, self._snapshot(None))

    def further(self, command: Command, time: float) -> Callable[[], Plan] | None:
        """Order a path that extends the running motion, as `later`; None if it cannot be extended."""
        now = self._snapshot(time)
        return self._order(command, now) if now.movable else None

    def hold(self, plan: Plan) -> bool:
        """Return whether a plan is still valid in the present state."""
        goes_on = plan.state.get("after") is not None
        now = self._snapshot(0.0 if goes_on else None)
        return plan.until >= now.until and all(
            _same(value, getattr(now, name)) for name, value in plan.state.items()
        )

    def found(self, command: Command, plan: Plan | None = None) -> Any:
        """Return the result for a checked command, from a valid plan or a new one; raise RefusalError."""
        if plan is None or not self.hold(plan):
            plan = self._plan(command, self._snapshot(None), checked=True)
        found = plan.found
        if isinstance(found, RefusalError):
            raise found
        return found


C = TypeVar("C", bound=Command)


class CommandCall(NamedTuple, Generic[C]):
    """A command being carried out between two ticks."""

    command: C
    tick: int  # number of the next control period
    now: float  # time; only ticks advance it [s]
    session: str | None  # session of the client that gets control, if `client_gone` will report its end
    planned: Callable[[], Any]
    """Returns the plan, making it if necessary; raises `RefusalError` if the command is impossible."""
    origin: str | None = None  # IP address of the sender; None if unknown


class CommandRow(NamedTuple):
    """One type of command: how a controller carries out the command, and what it needs for that.

    The protocol's table of transitions defines which commands move the arm, and when each is allowed.
    """

    message: type[Command]
    handle: Callable[[Any, CommandCall[Any]], Reply | None]
    """Carries out a checked command on a `Robot`. Raises `RefusalError` before any change; None means the
    reply `Done`."""
    lease: Literal["needed", "if named", "none"] = "needed"
    """When the command's token must be that of the lease: always, if present, or never, because it has
    another meaning."""
    changes_io: bool = False  # whether the command may change what `io` reports
    check: Callable[[Any, RobotDescription], None] | None = None
    """Refuses a command that this robot can never carry out; None if the types of the fields suffice."""
    plan: Planning | None = None  # how the command is planned; None if it needs no plan
    long: bool = False  # whether the message may be longer than `EXPLAINED_BYTES`
    stops: bool = False  # whether the command stops the arm and so must not wait for earlier plans

    @property
    def asks(self) -> bool:
        """True for queries of the tool's kinematics, which move nothing."""
        return self.plan is not None and self.plan.needs is TOOL
