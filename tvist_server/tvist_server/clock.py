"""Clocks of served robots: the wall clock, or a client's steps.

In both cases one thread owns a controller, and other threads reach the controller through a queue of jobs.
"""

import contextlib
import ctypes
import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial

from tvist_controller.host import Host
from tvist_plant.plant import PlantError
from tvist_server.jobs import Do, Jobs
from tvist_server.lateness import Lateness, Punctuality
from tvist_server.overload import Overload
from tvist_server.punctual import PRIORITY, take_priority
from tvist_server.schedule import Followed, Schedule

log = logging.getLogger(__name__)

LONGEST_SLEEP = 0.1
"""Longest sleep of the tick thread before it checks whether it should end [s]."""
LONGEST_TICK = 1.5
"""Longest wait at the end for a tick in progress [s]: a call of somebody's own arm may never return, and in lockstep
a client may have stopped reading.
"""
REPEAT_EVERY = 1.0
"""Time after which a robot in lockstep publishes its last state again, if there was no step meanwhile [s]."""
SET_TIMER_SLACK = 29
"""Option of prctl for the timer slack: the largest delay with which a thread may be woken, in nanoseconds."""


class Mailbox:
    """A robot as seen by a clock: its host, and the jobs to do between two of its ticks.

    Args:
        host: The controller.
        patience: Returns how long a step may wait for a socket that a program reads [s].
        pace: Waits until the arm begins its next tick, at most the time that it is given [s], and returns whether it
            has; None if a clock gives the tick.
        interval: Time between two ticks of an arm that counts by its own clock those that are missing [s]; None if it
            has none.
    """

    def __init__(
        self,
        host: Host,
        patience: Callable[[], float] = float,
        pace: Callable[[float], bool] | None = None,
        interval: float | None = None,
    ) -> None:
        self.host, self.pace, self.interval = host, pace, interval
        self._patience = patience
        self.jobs = Jobs()
        self.ending = False
        """Whether a step in progress has to end."""
        self.lateness = Lateness()
        self.overload: Overload | None = None
        """Count of the ticks that were due; None if a client advances time."""

    def post(self, do: Do, client: str | None = None) -> None:
        """Queue a job for the controller's thread, before its next tick. Callable from any thread; does not block.

        Args:
            do: Job to do.
            client: Client that sent it, if known.
        """
        self.jobs.post(do, client)

    def guarded(self, do: Do) -> None:
        """Do something of the robot; an exception that its host does not survive ends the robot alone."""
        try:
            do()
        except Exception:
            log.exception("a robot ticks no more")
            self.end("the robot ticks no more, because of an error: see the log")

    def turn(self) -> None:
        """Do the jobs that wait, and tick."""
        self.guarded(self.jobs.do_waiting)
        if self.host.failure is None:
            self.guarded(self.host.tick)

    def end(self, why: str) -> None:
        """Let the robot tick no more; its arm is left without it."""
        self.host.failure = why
        with contextlib.suppress(Exception):  # each arm is left, whatever the others do
            self.host.leave_arm()

    def attend(self, stepper: str | None) -> bool:
        """Between the ticks of a client's step, do the jobs of others; return whether the step may continue.

        If a program waits for data, wait for them a while: time must not pass before anyone could send them.
        """
        self.jobs.do_others(stepper)
        while not self.ending and (left := self._patience()) > 0.0:
            self.jobs.do_next_other(stepper, left)
        return not self.ending


class Clock(ABC):
    """A thread that runs jobs and ticks.

    Args:
        robots: Robots to tick.
    """

    def __init__(self, robots: Sequence[Mailbox]) -> None:
        self._robots = robots
        self._running = True
        self._thread = threading.Thread(target=self._guarded, name="tvist-tick", daemon=True)

    def start(self) -> None:
        """Start to run jobs and to tick."""
        self._thread.start()

    def close(self) -> None:
        """End the thread: a step ends before its next tick; in real time, all waiting jobs are done first.

        A thread that an arm, or a client that has stopped reading, does not let go is left to the end of the process.
        """
        self._running = False
        for robot in self._robots:
            robot.ending = True
            robot.post(_nothing)
        if self._thread.is_alive():
            self._thread.join(LONGEST_TICK)
            if self._thread.is_alive():
                log.error(
                    "a tick, a call of the arm or a wait for a client has not returned for %g s", LONGEST_TICK
                )

    @abstractmethod
    def punctuality(self, robot: Mailbox) -> Punctuality | None:
        """Lateness of a robot's ticks since the last call; None if time does not pass by itself."""

    def _guarded(self) -> None:
        try:
            self._run()
        except BaseException:  # the thread must not end silently
            log.exception("the controller's thread ended")
            for robot in self._robots:
                robot.end("the controller's thread ended by an error: see the log")

    @abstractmethod
    def _run(self) -> None: ...


class Lockstep(Clock):
    """Time passes when a client steps; every second, the robot may publish its last state again for new clients.

    Each robot has a thread of its own, since a step can take long and must not delay the clients of other robots.

    Args:
        robot: The robot.
        repeat: Publishes the robot's last state again, unless time has passed since the call before.
    """

    def __init__(self, robot: Mailbox, repeat: Do) -> None:
        super().__init__([robot])
        self._jobs = robot.jobs
        self._repeat = repeat

    def punctuality(self, robot: Mailbox) -> None:
        """Return None, since a client advances time."""

    def _run(self) -> None:
        # By a deadline of its own: other jobs, such as telemetry, may come in every second, too.
        due = time.monotonic() + REPEAT_EVERY
        while self._running:
            self._robots[0].guarded(partial(self._jobs.do_next, max(0.0, due - time.monotonic())))
            if self._running and time.monotonic() >= due:
                self._repeat()
                due = time.monotonic() + REPEAT_EVERY


class Realtime(Clock):
    """Ticks at every period of the monotonic clock, for all robots in one thread, by a `Schedule`; or of one arm's.

    Args:
        robots: Robots to tick.
        period: Tick [s].
        speed: Simulation speed relative to real time [-].
        priority: Whether to ask the system for real-time priority.
    """

    def __init__(
        self,
        robots: Sequence[Mailbox],
        period: float,
        speed: float = 1.0,
        *,
        priority: bool = False,
    ) -> None:
        super().__init__(robots)
        self._period = period / speed
        self._overloads = [Overload(robot.interval or self._period) for robot in robots]
        for robot, overload in zip(robots, self._overloads, strict=True):
            robot.overload = overload
        self._priority = priority
        self._asked = threading.Event()
        self.granted: list[str] = []
        """What the system has granted the thread, in words; complete after `start`."""

    def start(self) -> None:
        """Start the thread, and wait until it has asked for what it is to have."""
        super().start()
        self._asked.wait()

    def punctuality(self, robot: Mailbox) -> Punctuality:
        """Lateness since the last call."""
        return robot.lateness.look()

    def _run(self) -> None:
        try:
            self._ask()
        finally:
            self._asked.set()
        robots, overloads, now, sleep = self._robots, self._overloads, time.monotonic, time.sleep
        pace, silent = robots[0].pace, False
        schedule: Schedule | Followed = (
            Schedule(len(robots), self._period, now())
            if pace is None
            else Followed(robots[0].interval or self._period, now(), counts=robots[0].interval is None)
        )
        while self._running:
            if pace is not None:
                if not self._begins(robots[0], pace):
                    silent = self._do_without_tick(robots[0], silent)
                    continue
                silent = False
            elif (wait := schedule.due - now()) > 0.0:
                sleep(min(wait, LONGEST_SLEEP))
                if wait > LONGEST_SLEEP:
                    continue
            begun = now()
            number, late, missed = schedule.begin(begun)
            robot = robots[number]
            robot.lateness.note(late)
            if missed:
                robot.host.missed(missed)
            told = overloads[number].note(missed)
            if told is not None:
                robot.host.warn(told)
            robot.turn()
            robot.lateness.worked(now() - begun)
        for robot in robots:
            robot.guarded(robot.jobs.do_waiting)

    def _begins(self, robot: Mailbox, pace: Callable[[float], bool]) -> bool:
        """Wait until the arm begins its next tick; one that fails there has it from this clock, and stops."""
        try:
            return pace(LONGEST_SLEEP)
        except PlantError as error:
            robot.host.fail(str(error))
            time.sleep(self._period)
            return True

    def _do_without_tick(self, robot: Mailbox, silent: bool) -> bool:
        """Answer the clients of an arm that has fallen silent, and tell them once; return True."""
        robot.guarded(robot.jobs.do_waiting)
        if not silent and robot.interval is None:  # a robot that is watched says by itself when it is lost
            robot.host.warn(
                "the arm does not begin its next tick: time stands still, and it obeys no command"
            )
        return True

    def _ask(self) -> None:
        """Ask the system for what belongs to the calling thread."""
        _wake_sharply()
        if self._priority and take_priority():
            self.granted.append(f"real-time priority {PRIORITY}")


def _nothing() -> None:
    pass


def _wake_sharply() -> None:
    """Ask for exact wake-ups of the calling thread; by default the system may delay them by 50 µs."""
    with contextlib.suppress(OSError, AttributeError):  # elsewhere ticks are that much later
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, 1, 0, 0, 0)
