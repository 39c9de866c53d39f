"""Motions of programs: one thread moves the arm at a time, moves blend, motions may outlast their call."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tvist_controller.programs.access import Access, refusals_as_faults
from tvist_controller.programs.blended_moves import BlendedMoves, RateLimit, Turns
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import Segment
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity, after
from tvist_urscript import Fault, Machine

BRAKING = 2.0  # deceleration of the fastest joint before a move that follows an unfinished motion [rad/s^2]
RESTART_TICKS = 10  # ticks in which a thread may restart force mode after a pause or protective stop ended it
LOST = (
    "force mode has ended, by a pause or a protective stop, and the arm does not move on without it: call force_mode "
    "again, or end_force_mode, before it moves"
)
STREAMED = "a client streams set-points to the arm, so the program cannot move it"
TAKEN = "another thread is controlling the robot: only one thread of a program can move it at a time"


class ProgramArm:
    """Carries out the motions of one robot's programs.

    `thread` returns the running program and its thread's number. `lives` returns whether a thread still runs.
    `spend` takes evaluations from the running program's budget.
    """

    def __init__(
        self,
        access: Access,
        thread: Callable[[], tuple[Machine, int]],
        lives: Callable[[object], bool],
        spend: Callable[[int], None],
    ) -> None:
        self._access, self._motion, self._thread, self.spend = access, access.motion, thread, spend
        self._lives = lives
        self._rate_limit = RateLimit(access.motion, access.latest)
        self._inside: object | None = None  # thread whose move has not returned yet
        self.driver: tuple[Machine, int] | None = None
        """Program and thread number that started the guided motion."""
        self._blended: dict[object, BlendedMoves] = {}  # moves of each thread, until the last one is done
        self._current: BlendedMoves | None = None  # the moves in progress
        self._guided: int | None = None
        self._abandoned = False
        self._asked = 0  # number of threads waiting to start compliance
        self._complying: object | None = None  # program that made the arm compliant, until it ends compliance
        self.lead: Callable[[Segment], Turns] | None = None  # makes a move while the arm is compliant
        self.waypoint: Segment | None = None  # target of the present or last move

    # ------------------------------------------------------------------ planned moves

    def follow(self, segment: Segment) -> Turns:
        """Move along a part of a path; if it blends into the next, the program continues meanwhile."""
        self._check_alone()
        if (moves := self._present()) is None:
            moves = BlendedMoves(self._access, self._thread(), self._rate_limit, self._come_to_rest)
            self._blended[self._thread()] = moves
        moves.add(segment)
        if moves.begun:
            self.waypoint = segment
        moves.closed = segment.blend == 0.0
        yield from self._carry_out(moves)

    def begin(self) -> None:
        """Start this thread's waiting moves; further moves can still be added."""
        moves = self._present()
        if moves is not None and not moves.begun:
            self._check_alone()
            self._begin(moves)

    def finish(self) -> Turns:
        """Complete this thread's moves without another blend."""
        if (moves := self._present()) is not None:
            moves.closed = True
            yield from self._carry_out(moves)

    def _carry_out(self, moves: BlendedMoves) -> Turns:
        """Carry out moves until all are over, or until another move may be added."""
        if not (moves.closed or moves.full):
            return
        with self._moving():
            self._begin(moves)
            while not (moves.over or self._led(moves)) and (moves.closed or moves.full):
                yield
        if self._led(moves):
            assert self.lead is not None, "who makes moves can lead them"
            for segment, effects in moves.hand_over():
                yield from self.lead(segment)
                for effect in effects:
                    effect()
        self._present()

    def _led(self, moves: BlendedMoves) -> bool:
        """Return whether force control must carry out the moves, as another thread made the arm compliant."""
        waits = moves.number is None and not moves.over
        return waits and self._access.guidance.compliant is not None

    def _present(self) -> BlendedMoves | None:
        """Return this thread's moves that can be blended with another one."""
        moves = self._blended.get(self._thread())
        if moves is None or not moves.over:
            return moves
        del self._blended[self._thread()]
        if moves.fault is not None:
            raise moves.fault
        return None

    def _begin(self, moves: BlendedMoves) -> None:
        self._current = moves
        if not moves.begun:
            self.waypoint = moves.legs[-1]
            moves.step()

    def advance(self) -> None:
        """Continue the moves in progress; called first in every tick unless the program is paused."""
        if self._current is not None and self._current.begun:
            self._current.step()

    def then(self, effect: Callable[[], None]) -> None:
        """Call `effect` at the start of the blend after the thread's last waiting move; now if none waits."""
        if (moves := self._present()) is None:
            effect()
        else:
            moves.then(effect)

    @property
    def end(self) -> Segment | None:
        """Last waiting move of this thread; None without one."""
        moves = self._present()
        return None if moves is None else moves.legs[-1]

    def _come_to_rest(self) -> Turns:
        """Stop what still moves; a protective stop in this tick pauses the program here."""
        motion = self._motion
        if motion.activity is Activity.STREAMING:
            raise Fault(STREAMED)
        if motion.activity in {Activity.GUIDED, Activity.MOVING, Activity.PAUSED}:
            self.brake(lambda: self._access.guidance.stop_joints(BRAKING))
        while (
            motion.activity.moving or motion.activity.protective or self._rate_limit.waits or self._asked > 0
        ):
            yield

    # ------------------------------------------------------------------ guided motions

    def guide(self, start: Callable[[bool], int | None], wait: Iterator[None]) -> Turns:
        """Start or change a guided motion by `start(shaped)`, run `wait`; the motion continues afterwards."""
        yield from self.finish()
        with self._moving():
            yield from self.regain()
            while self._stopping("speed_j") or self._rate_limit.waits:
                yield
            self.steer(start)
            yield from wait

    def _stopping(self, command: str) -> bool:
        """Return whether a command's motion must wait for a stop in progress or a protective stop."""
        activity = self._motion.activity
        return (activity.moving or activity.protective) and after(activity, command) is None

    def regain(self) -> Turns:
        """Wait for a stop's end and, if that ended force mode, for its restart by a thread; else Fault."""
        left = RESTART_TICKS
        while (stopping := self._stopping("speed_j")) or (self.compliance_lost and left > 0):
            left -= not (stopping or self._asked)
            yield
        if self.compliance_lost:
            raise Fault(LOST)

    @property
    def compliance_lost(self) -> bool:
        """Whether a stop has ended a force mode that the program started."""
        return self._complying is self._thread()[0] and self._access.guidance.compliant is None

    def start_compliance(self, start: Callable[[], int]) -> Turns:
        """Start or change compliance; `start` does that and returns the motion's number."""
        yield from self.finish()
        self._asked += 1
        try:
            while self._stopping("force_mode") or self._rate_limit.waits:
                if self._motion.activity is Activity.STREAMING:
                    raise Fault(STREAMED)
                yield
            self._replace(start)
        finally:
            self._asked -= 1
        self._complying = self._thread()[0]

    def end_compliance(self, *, by_hand: bool) -> None:
        """End freedrive or force mode started by `start_compliance`."""
        force, self._complying = self._access.force, None
        if force.by_hand == by_hand and self._access.guidance.compliant is not None:
            self.brake(force.end, wholly=True)

    def steer(self, start: Callable[[bool], int | None]) -> None:
        """Start or change a guided motion within a call of `guide`, except in a protective stop."""
        motion = self._motion
        if motion.activity.protective:
            return
        shaped = self._access.shape_guided and (
            motion.activity is Activity.REST
            or (motion.activity is Activity.GUIDED and motion.cycle.mode.shaped)
        )
        self._current = None
        self._replace(lambda: start(shaped))
        self.driver = None if self._guided is None else self._thread()

    def _replace(self, start: Callable[[], int | None]) -> None:
        """Replace the guided motion; `hear` then ignores that the old one has stopped."""
        guided, self._guided = self._guided, None
        try:
            with refusals_as_faults():
                guided = start()
        finally:
            self._guided = guided

    def in_motion(self, seconds: float) -> Iterator[None]:
        """Wait for a time that is scaled with the motion's rate [s], at least a tick."""
        while True:
            yield
            rate = self._motion.motions.speed
            seconds -= rate * PERIOD
            if seconds < 0.5 * rate * PERIOD:
                return

    def halt(self, stop: Callable[[], None]) -> Turns:
        """Start a stop and wait until the arm is at rest."""
        yield from self.finish()
        with self._moving():
            self.brake(stop)
            yield
            while not self._access.guidance.resting:
                yield

    def abort(self) -> None:
        """Stop the program's present planned move, if any; the program continues as if the move had ended."""
        if (moves := self._current) is None:
            return
        moves.skipped = True
        if moves.number is not None:
            self.brake(lambda: self._access.guidance.stop_joints(BRAKING))
            moves.outcome = "motion_done"

    def brake(self, stop: Callable[[], None], *, wholly: bool = False) -> None:
        """Stop the present motion at the program's request; compliance continues unless `wholly`."""
        guidance = self._access.guidance
        if self._motion.activity.moving:
            self._rate_limit.charge()
        guided, self._guided = self._guided, None  # so that `hear` ignores its end
        self.driver, self._abandoned = None, False
        if self._current is not None:
            self._current.number = None
        if wholly or guidance.compliant is None:
            stop()
        else:
            guidance.stand(BRAKING)
        if guidance.compliant is not None:
            self._guided = guided

    # ------------------------------------------------------------------ threads and events

    @property
    def ends(self) -> bool:
        """Whether the running program has nothing left to do."""
        return self._thread()[0].at_end

    @property
    def moves(self) -> bool:
        """Whether a planned motion of the program is running."""
        return self._current is not None and self._current.number is not None

    @property
    def guides(self) -> bool:
        """Whether a guided motion of the program is running."""
        return self._guided is not None

    def settle(self) -> None:
        """Stop a motion whose thread has ended, unless another took over; called at the end of each turn."""
        self._rate_limit.planning = max(self._rate_limit.planning - 1, 0)
        moves = self._current
        if moves is not None and not (moves.over or self._lives(moves.owner)):
            self._abandoned |= moves.number is not None
            self._current = None
        if self.driver is not None and not self._lives(self.driver):
            self._abandoned = True
        if self._abandoned:
            self.brake(lambda: self._motion.stop(None, "the thread that moved the arm has ended"))
        for thread in [thread for thread in self._blended if not self._lives(thread)]:
            del self._blended[thread]

    def forget(self) -> None:
        """Forget all motions after the program's end."""
        self._inside = self.driver = self._current = self._guided = self._complying = None
        self._blended.clear()
        self._abandoned, self._rate_limit.planning = False, 0

    def hear(self, event: Event) -> bool:
        """Handle an event; return whether it ended a motion that the program did not stop itself."""
        moves = self._current
        moving = None if moves is None else moves.number
        if event.kind == "protective_stop":
            self._guided = self.driver = None
            if moves is not None and moving is not None:
                moves.stop()
        if event.id is None or event.id not in {moving, self._guided}:
            return False
        stopped = event.kind == "motion_stopped" and event.code != "plant_failure"
        if event.id == moving and moves is not None:
            stopped = stopped and moves.outcome is None
            if event.kind in {"motion_done", "motion_stopped"}:
                moves.outcome, moves.number = event.kind, None
        if event.kind == "motion_stopped":
            self._guided = None
        return stopped

    def _check_alone(self) -> None:
        moves, owner = self._current, None
        if moves is not None and not moves.over and self._lives(moves.owner):
            owner = moves.owner
        if {self._inside, owner} - {None, self._thread()}:
            raise Fault(TAKEN)

    @contextmanager
    def _moving(self) -> Iterator[None]:
        """Keep other threads from moving the arm. If the thread is killed, its motion counts as abandoned."""
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
