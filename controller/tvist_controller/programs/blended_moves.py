"""A program's moves blended into one motion, which can be extended while it runs."""

from collections.abc import Callable, Generator

from msgspec.structs import asdict

from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.plan import Plan
from tvist_controller.programs.access import OWN_TOKEN, Access, refusals_as_faults
from tvist_controller.refusal import RefusalError
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_protocol.motions import JointSegment, LineSegment, MoveL, MovePath, Segment
from tvist_protocol.replies import Accepted
from tvist_protocol.stream import State
from tvist_protocol.transitions import Activity
from tvist_urscript import Fault

Turns = Generator[None, None, None]  # run of a waiting function; it yields once per tick
Effect = Callable[[], None]

DELAY, DELAY_PER_PART = 10, 4
"""Ticks from the call of a line or path to its start, plus ticks per further part: time for planning. They do
not depend on the planning time, so equal programs move alike."""
EXTENSION_DELAY, EXTENSION_DELAY_PER_MOVE = 12, 1
"""Ticks from ordering an extension of the running motion until it applies, plus ticks per move."""
MAX_PARTS = 50
"""Largest number of moves planned together from rest, and waiting; with more, the program waits."""
MAX_FURTHER = 25  # largest number of moves per extension of a running motion
AHEAD = 150  # number of moves ahead of the arm from which on no more are planned
SPARE_TICKS = 4  # further ticks for which the running motion stays unchanged, since rate changes look ahead
PAUSE = 300
"""Ticks charged for a stop or a `movej` planned within a tick. These take longest in a tick, so fewer than
one tick in a hundred may have one."""
_UNREACHABLE = frozenset({"no_solution", "singular", "collision", "limit_position"})
"""Refusals of a started motion that cause a protective stop."""


class RateLimit:
    """Limits the rate of stops and plans of a robot's programs."""

    def __init__(self, motion: MotionControl, latest: Callable[[], State]) -> None:
        self._motion, self._latest = motion, latest
        self.planning = 0  # remaining ticks of the last ordered plan
        self._paid = 0  # tick until which past stops and plans are charged

    @property
    def debt(self) -> int:
        """Ticks that are still charged for past stops and plans."""
        return max(self._paid - self._latest().tick, 0)

    def charge(self) -> None:
        """Charge for a stop or plan."""
        self._paid = self._latest().tick + self.debt + PAUSE

    @property
    def waits(self) -> bool:
        """Whether the next motion must wait because stops and plans were too frequent."""
        return self._motion.activity is Activity.REST and self.debt > 2 * PAUSE


class BlendedMoves:
    """The blended moves of one thread, and the motion along them.

    The motion starts when the last move is known, or when the most moves that are planned together wait.
    `step` continues it every tick while the thread adds moves. Each plan ends at rest, so the arm stops where
    the next move comes too late. `rest` stops other motion and waits until a motion may start.
    """

    def __init__(
        self, access: Access, owner: object, rate_limit: RateLimit, rest: Callable[[], Turns]
    ) -> None:
        self._access, self._motion, self.owner = access, access.motion, owner
        self._rate_limit, self._rest = rate_limit, rest
        self.legs: list[Segment] = []  # moves not yet passed by the arm
        self._effects: list[list[Effect]] = []  # effects of the program after each of these moves
        self.closed = False  # whether no more moves will come
        self.number: int | None = None  # number of the motion while it runs
        self.outcome: str | None = None  # event that ended the motion
        self._stops_at: tuple[int, float] | None = None
        """Progress at the end of the motion's protective stop, see `stop`; None without one."""
        self.skipped = False  # whether `abort` was called; a motion then being planned is not started
        self.over = False  # whether all moves are complete
        self.fault: Exception | None = None  # error that the thread of these moves will raise
        self._steps: Turns | None = None
        self._marks: list[tuple[int, float]] = []
        """Where the blend at the end of each present move begins, see `PlannedMove.marks`."""
        self._extension: tuple[Callable[[], Plan], int, int] | None = None
        """Ordered plan of an extension, tick at which it applies, and number of moves."""
        self._final = self._refuses = False
        """Nothing can extend the motion under way; the next move is impossible."""
        self._count = 0  # number of moves of the running motion

    # ------------------------------------------------------------------ for the program

    def add(self, leg: Segment) -> None:
        """Add the next move."""
        self.legs.append(leg)
        self._effects.append([])

    def then(self, effect: Effect) -> None:
        """Do something at the start of the blend after the last move."""
        self._effects[-1].append(effect)

    @property
    def full(self) -> bool:
        """Whether the largest number of moves is waiting."""
        return len(self.legs) - len(self._marks) >= MAX_PARTS

    @property
    def begun(self) -> bool:
        """Whether the motion has started."""
        return self._steps is not None

    def hand_over(self) -> list[tuple[Segment, list[Effect]]]:
        """End these moves; return remaining ones with their effects, to be carried out by force control."""
        self.over = True
        return list(zip(self.legs, self._effects, strict=True))

    def stop(self) -> None:
        """Record a protective stop. On resumption, moves up to the arm's place of rest count as passed."""
        move = self._motion.motions.move
        self.outcome, self._stops_at = "protective_stop", None if move is None else move.stops_at

    # ------------------------------------------------------------------ in every tick

    def step(self) -> None:
        """Do the work of this tick; the first call starts the motion."""
        if self.over:
            return
        if self._steps is None:
            self._steps = self._carry_out()
        try:
            next(self._steps)
        except StopIteration:
            self.over = True
        except Exception as fault:  # noqa: BLE001  the thread that it concerns raises it again
            self.over, self.fault = True, fault

    def _carry_out(self) -> Turns:
        while self.legs:
            self.skipped = False
            yield from self._rest()
            self._check_ready()
            legs = self.legs[:MAX_PARTS]
            plan = yield from self._planned(legs)
            if self._motion.activity.protective:
                continue
            if self.skipped:
                break
            if isinstance(plan.found, RefusalError):
                self._refused(plan.found, legs)  # after a protective stop, resuming tries again
                continue
            self._start(legs, plan)
            while self.outcome is None:
                yield
                move = self._motion.motions.move
                self._pass_blends(None if move is None else move.progress)
                self._extend()
            self._pass_blends(self._stops_at)
            self._marks, ended = [], len(self._marks)
            if self.outcome == "motion_done":
                self._warn_of_stop(ended)
                self._pass(len(self.legs) if self.skipped else ended)
        self._pass(len(self.legs))

    def _warn_of_stop(self, ended: int) -> None:
        """Warn that the arm stopped at a blend because the next move came too late."""
        comes = len(self.legs) > ended or not self.closed
        if comes and self.legs[ended - 1].blend > 0.0 and not (self._refuses or self.skipped):
            where = f"segments[{self._count - 1}]"
            why = f"{where}: the arm stops there, since the move after it was not known in time for its blend"
            self._access.emit("warning", code="blend_skipped", why=why)

    def _command(self, legs: list[Segment]) -> MoveJ | MoveL | MovePath:
        return command_of(
            legs, goes_on=legs[-1].blend > 0.0 and not (self.closed and legs[-1] is self.legs[-1])
        )

    def _start(self, legs: list[Segment], plan: Plan) -> None:
        with refusals_as_faults():
            reply = self._access.send(self._command(legs), plan)
        assert isinstance(reply, Accepted)
        assert isinstance(plan.found, PlannedMove)
        self.number, self.outcome, self._stops_at = reply.id, None, None
        self._extension, self._final, self._refuses = None, False, False
        self._marks = list(plan.found.marks) or [(0, float("inf"))]
        self._count = len(legs)

    def _planned(self, legs: list[Segment]) -> Generator[None, None, Plan]:
        """Plan joint moves at once; lines, paths, and joint moves in debt a fixed time after the order."""
        plans, command = self._access.plans, self._command(legs)
        if isinstance(command, MoveJ) and self._rate_limit.debt < PAUSE:
            self._rate_limit.charge()
            return plans.now(command, within_tick=True)
        while True:
            while self._rate_limit.planning > 0:  # one at a time, also of killed threads
                yield
            self._rate_limit.planning = DELAY + DELAY_PER_PART * (len(legs) - 1)
            ordered = plans.later(command)
            for _ in range(self._rate_limit.planning):
                yield
            yield from self._rest()  # a client may have moved the arm meanwhile
            self._check_ready()
            plan = ordered()
            if plans.hold(plan):
                return plan

    def _extend(self) -> None:
        """Extend the running motion to moves that have come meanwhile."""
        if self._extension is not None and not self._apply_extension():
            return
        under_way = len(self._marks)
        legs = self.legs[under_way : under_way + MAX_FURTHER]
        if not legs or under_way >= AHEAD or self._final or self.legs[under_way - 1].blend == 0.0:
            return
        ticks = EXTENSION_DELAY + EXTENSION_DELAY_PER_MOVE * len(legs)
        ordered = self._access.plans.further(command_of(legs, goes_on=True), (ticks + SPARE_TICKS) * PERIOD)
        if ordered is not None:
            self._extension = ordered, self._access.latest().tick + ticks, len(legs)

    def _apply_extension(self) -> bool:
        """Apply the plan of an extension when due; return whether another may be ordered."""
        assert self._extension is not None
        ordered, due, count = self._extension
        if self._access.latest().tick < due:
            return False
        plan, self._extension = ordered(), None
        if not self._access.plans.hold(plan):  # outdated
            return True
        if not isinstance(plan.found, PlannedMove):  # plan the moves again from the end of the motion
            self._final, self._refuses = True, plan.found is not None
            return False
        part = self._marks[-1][0]
        self._motion.motions.extend(plan.found)
        self._marks[-1:] = [(part + number, place) for number, place in plan.found.marks]
        self._count += count
        return True

    def _pass_blends(self, progress: tuple[int, float] | None) -> None:
        """Apply the effects of each blend that the arm has begun, see `RunningMove.progress`."""
        while progress is not None and len(self._marks) > 1 and progress > self._marks[0]:
            del self._marks[0]
            self._pass(1)

    def _pass(self, count: int) -> None:
        effects = self._effects[:count]
        del self.legs[:count], self._effects[:count]
        for each in effects:
            for effect in each:
                effect()

    def _check_ready(self) -> None:
        with refusals_as_faults():
            self._motion.check("move_j")

    def _refused(self, refusal: RefusalError, legs: list[Segment]) -> None:
        """For a refused move, end the program; for an unreachable line or path, make a protective stop."""
        reply = refusal.reply
        if isinstance(command_of(legs), MoveJ) or reply.code not in _UNREACHABLE:
            raise Fault(reply.why)
        self._motion.protect(f"the program's move was refused: {reply.why}", reply.code)


def command_of(legs: list[Segment], *, goes_on: bool = False) -> MoveJ | MoveL | MovePath:
    """Return the simplest command for moves blended into one motion; only a path can be extended."""
    if goes_on or len(legs) > 1:
        return MovePath(token=OWN_TOKEN, segments=tuple(legs))
    fields = {name: value for name, value in asdict(legs[0]).items() if name != "blend"}
    match legs[0]:
        case JointSegment():
            return MoveJ(token=OWN_TOKEN, **fields)
        case LineSegment():
            return MoveL(token=OWN_TOKEN, **fields)
    return MovePath(token=OWN_TOKEN, segments=tuple(legs))
