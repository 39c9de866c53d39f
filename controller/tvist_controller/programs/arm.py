"""The arm as programs move it: one thread at a time, moves that are blended, and motions that outlast their call."""

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.plan import Plan
from tvist_controller.programs.access import Access
from tvist_controller.programs.moves import command_of
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_protocol.motions import Segment
from tvist_protocol.replies import Accepted
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity, after
from tvist_urscript import Fault

Turns = Generator[None, None, None]
"""Course of a function that lets time pass: it yields once a tick."""

DELAY, DELAY_PER_PART = 10, 4
"""Ticks from the call of a move along a line or path to its start, and ticks more for each further part of a path:
time to plan it beside the ticks. They do not depend on how long planning takes, so equal programs move alike.
"""
PAUSE = 300
"""Ticks that a stop, or a plan of a `movej` within a tick, is paid with. These two take longer than all else in a tick,
so fewer than one tick in a hundred may have one.
"""
MAX_PARTS = 50
"""Number of moves after which a path ends though its last move has a blend."""
BRAKING = 2.0
"""Deceleration of the fastest joint where a move follows a motion that has not ended [rad/s^2]."""
TAKEN = "another thread is controlling the robot: only one thread of a program can move it at a time"
_UNREACHABLE = frozenset({"no_solution", "singular", "collision", "limit_position"})
"""Reasons for which a motion that a program has begun ends in a protective stop."""


@dataclass
class _Path:
    """Moves that are blended into one motion."""

    legs: list[Segment] = field(default_factory=list)
    effects: list[list[Callable[[], None]]] = field(default_factory=list)
    """What the program does after each move, until the next."""


class ProgramArm:
    """Carries out the motions of one robot's programs.

    Args:
        access: The robot.
        thread: Returns what identifies the thread that runs now.
        spend: Takes evaluations from the budget of the program that runs.
    """

    def __init__(self, access: Access, thread: Callable[[], object], spend: Callable[[int], None]) -> None:
        self._access, self._motion, self._thread, self.spend = access, access.motion, thread, spend
        self._inside: object | None = None
        """Thread whose move has not returned."""
        self._driver: object | None = None
        """Thread that began the guided motion."""
        self._paths: dict[object, _Path] = {}
        """Path of each thread whose last move is blended into a next one that has not come yet."""
        self._number: int | None = None
        """Number of the planned motion, while the program waits for its end."""
        self._guided: int | None = None
        self._outcome: str | None = None
        self._abandoned = False
        self._own = False
        self._planning = 0
        """Ticks for which the last plan that was ordered is still being made."""
        self._paid = 0
        """Tick at which all stops and plans are paid."""
        self._skipped = False
        """True after a call of `abort`; a motion that was being planned then is not started."""
        self.waypoint: Segment | None = None
        """Target of the present move, or of the last one."""

    # ------------------------------------------------------------------ planned moves

    def follow(self, segment: Segment) -> Turns:
        """Move along a part of a path. If it is blended into the next, the call returns for the program to go on.

        Raises:
            Fault: Another thread moves the arm, or there is no such motion.
        """
        self._check_alone()
        path = self._paths.setdefault(self._thread(), _Path())
        path.legs.append(segment)
        path.effects.append([])
        if segment.blend == 0.0 or len(path.legs) >= MAX_PARTS:
            yield from self.finish()

    def finish(self) -> Turns:
        """Carry out the moves of this thread that wait for a further one."""
        path = self._paths.pop(self._thread(), None)
        if path is not None:
            with self._moving():
                yield from self._travel(path)

    def then(self, effect: Callable[[], None]) -> None:
        """Do something now, or where the blend after the last move begins if moves of this thread are waiting."""
        path = self._paths.get(self._thread())
        if path is None:
            effect()
        else:
            path.effects[-1].append(effect)

    @property
    def end(self) -> Segment | None:
        """Last of the waiting moves of this thread."""
        path = self._paths.get(self._thread())
        return None if path is None else path.legs[-1]

    def _travel(self, path: _Path) -> Turns:
        while path.legs:
            self.waypoint, self._skipped = path.legs[-1], False
            yield from self._come_to_rest()
            self._check_ready()
            plan = yield from self._planned(path.legs)
            if self._motion.activity.protective:
                continue
            if self._skipped:
                for effects in path.effects:
                    self._pass(effects)
                return
            if isinstance(plan.found, RefusalError):
                self._refused(
                    plan.found, path.legs
                )  # in a protective stop, it tries again when it is resumed
                continue
            marks = self._start(path.legs, plan)
            passed = 0
            while self._outcome is None:
                yield
                while passed < len(path.legs) - 1 and self._beyond(marks, passed):
                    self._pass(path.effects[passed])
                    passed += 1
            if self._outcome == "motion_done":
                for effects in path.effects[passed:]:
                    self._pass(effects)
                passed = len(path.legs)
            del path.legs[:passed], path.effects[:passed]

    def _start(self, legs: list[Segment], plan: Plan) -> tuple[tuple[int, float], ...]:
        """Start a planned motion; return where its blends begin, see `PlannedMove.marks`."""
        try:
            reply = self._access.send(command_of(legs), plan)
        except RefusalError as refusal:
            raise Fault(refusal.reply.why) from refusal
        assert isinstance(reply, Accepted)
        assert isinstance(plan.found, PlannedMove)
        self._number, self._outcome = reply.id, None
        return plan.found.marks

    def _planned(self, legs: list[Segment]) -> Generator[None, None, Plan]:
        """The plan of a move. Lines and paths, and joint moves in debt, begin a fixed time after it is ordered."""
        plans, command = self._access.plans, command_of(legs)
        if isinstance(command, MoveJ) and self._debt < PAUSE:
            self._owe()
            return plans.now(command, within_tick=True)
        while True:
            while self._planning > 0:  # of a thread that was killed meanwhile: one after the other
                yield
            self._planning = DELAY + DELAY_PER_PART * (len(legs) - 1)
            ordered = plans.later(command)
            for _ in range(self._planning):
                yield
            yield from self._come_to_rest()  # a client may have moved the arm meanwhile
            self._check_ready()
            plan = ordered()
            if plans.hold(plan):
                return plan

    def _beyond(self, marks: tuple[tuple[int, float], ...], leg: int) -> bool:
        """Return whether the arm has begun the blend at the end of a leg."""
        progress = self._motion.motions.progress
        return progress is not None and leg < len(marks) and progress > marks[leg]

    @staticmethod
    def _pass(effects: list[Callable[[], None]]) -> None:
        for effect in effects:
            effect()
        effects.clear()

    def _check_ready(self) -> None:
        try:
            self._motion.check("move_j")
        except RefusalError as refusal:
            raise Fault(refusal.reply.why) from refusal

    def _refused(self, refusal: RefusalError, legs: list[Segment]) -> None:
        """End a program whose move is impossible, or stop the robot if it is a line or path that leads nowhere."""
        reply = refusal.reply
        if isinstance(command_of(legs), MoveJ) or reply.code not in _UNREACHABLE:
            raise Fault(reply.why)
        self._motion.protect(f"the program's move was refused: {reply.why}", reply.code)

    def _come_to_rest(self) -> Turns:
        """Stop what still moves. In a protective stop of this tick the program is paused here."""
        motion = self._motion
        if motion.activity is Activity.STREAMING:
            raise Fault("a client streams set-points to the arm, so the program cannot move it")
        if motion.activity in {Activity.GUIDED, Activity.MOVING, Activity.PAUSED}:
            self.brake(lambda: self._access.guidance.stop_joints(BRAKING))
        while motion.activity.moving or motion.activity.protective or self._waits:
            yield

    # ------------------------------------------------------------------ guided motions

    def guide(self, start: Callable[[bool], int | None], wait: Callable[[], Iterator[None]]) -> Turns:
        """Begin or change a guided motion, which goes on when the call returns.

        Args:
            start: Begins it, shaped or not; returns its number, or None if there is nothing to move.
            wait: Lets time pass until the call returns.

        Raises:
            Fault: Another thread moves the arm, or the motion is not possible.
        """
        yield from self.finish()
        with self._moving():
            while self.stopping or self._waits:
                yield
            self.steer(start)
            yield from wait()

    @property
    def stopping(self) -> bool:
        """Whether a guided motion has to wait: for a stop under way, or in a protective stop of this tick."""
        activity = self._motion.activity
        return (activity.moving or activity.protective) and after(activity, "speed_j") is None

    @property
    def _debt(self) -> int:
        """Ticks until all stops and plans are paid."""
        return max(self._paid - self._access.latest().tick, 0)

    def _owe(self) -> None:
        self._paid = self._access.latest().tick + self._debt + PAUSE

    @property
    def _waits(self) -> bool:
        """Whether the next motion has to wait, since stops and plans were too close to each other."""
        return self._motion.activity is Activity.REST and self._debt > 2 * PAUSE

    def steer(self, start: Callable[[bool], int | None]) -> None:
        """Begin or change a guided motion within a call of `guide`; see there. In a protective stop nothing happens."""
        motion = self._motion
        if motion.activity.protective:
            return
        shaped = self._access.shape_guided and (
            motion.activity is Activity.REST
            or (motion.activity is Activity.GUIDED and motion.cycle.mode.shaped)
        )
        self._number, self._outcome, self._own = None, None, True
        try:
            self._guided = start(shaped)
            self._driver = None if self._guided is None else self._thread()
        except RefusalError as refusal:
            raise Fault(refusal.reply.why) from refusal
        finally:
            self._own = False

    def in_motion(self, seconds: float) -> Iterator[None]:
        """Let a time pass that is the motion's own: it lasts longer at a lower speed [s]. At least a tick passes."""
        while True:
            yield
            rate = self._motion.motions.speed
            seconds -= rate * PERIOD
            if seconds < 0.5 * rate * PERIOD:
                return

    def halt(self, stop: Callable[[], None]) -> Turns:
        """Stop the arm, and wait until it is at rest.

        Args:
            stop: Begins the stop of a motion.

        Raises:
            Fault: Another thread moves the arm.
        """
        yield from self.finish()
        with self._moving():
            self.brake(stop)
            yield
            while self._motion.activity.moving:
                yield

    def abort(self) -> None:
        """Stop the planned move that the program makes now, if there is one; it goes on as if the move had ended."""
        self._skipped = True
        if self._number is not None:
            self.brake(lambda: self._access.guidance.stop_joints(BRAKING))
            self._outcome = "motion_done"

    def brake(self, stop: Callable[[], None]) -> None:
        """Begin a stop of what moves, which is the program's own will."""
        if self._motion.activity.moving:
            self._owe()
        self._own = True  # so that `hear` does not take this stop for one that ends the program
        try:
            stop()
        finally:
            self._own = self._abandoned = False
            self._number = self._guided = self._driver = None

    # ------------------------------------------------------------------ threads and events

    @property
    def moves(self) -> bool:
        """Whether a planned motion of the program is running."""
        return self._number is not None

    @property
    def guides(self) -> bool:
        """Whether a guided motion of the program is running."""
        return self._guided is not None

    def settle(self, lives: Callable[[object], bool]) -> None:
        """Stop a motion whose thread has ended without another that took it over; called at the end of each turn.

        Args:
            lives: Returns whether a thread still runs.
        """
        self._planning = max(self._planning - 1, 0)
        if self._driver is not None and not lives(self._driver):
            self._abandoned = True
        if self._abandoned:
            self.brake(lambda: self._motion.stop(None, "the thread that moved the arm has ended"))
        for thread in [thread for thread in self._paths if not lives(thread)]:
            del self._paths[thread]

    def forget(self) -> None:
        """Forget all motions, since the program has ended."""
        self._inside = self._driver = self._number = self._guided = None
        self._paths.clear()
        self._abandoned, self._planning = False, 0

    def hear(self, event: Event) -> bool:
        """Handle an event of the robot; return whether it ended a motion of the program against its will."""
        if event.kind == "protective_stop":
            self._guided = self._driver = None
            if self._number is not None:
                self._outcome = event.kind
        if event.id is None or self._own or event.id not in {self._number, self._guided}:
            return False
        if event.kind == "motion_done":
            self._outcome, self._number = event.kind, None
        if event.kind != "motion_stopped":
            return False
        stopped = self._outcome is None and event.code != "plant_failure"
        self._outcome, self._number, self._guided = event.kind, None, None
        return stopped

    def _check_alone(self) -> None:
        if self._inside not in {None, self._thread()}:
            raise Fault(TAKEN)

    @contextmanager
    def _moving(self) -> Iterator[None]:
        """Keep other threads from moving the arm; a thread that is killed meanwhile leaves its motion behind."""
        self._check_alone()
        self._inside = self._thread()
        self._abandoned = False
        try:
            yield
        except GeneratorExit:
            self._abandoned = True
            raise
        finally:
            self._inside = None
