"""Clocks of served robots: the wall clock, or a client's steps.

Either way one thread owns a controller; jobs from elsewhere reach it through a queue.
"""

import contextlib
import ctypes
import logging
import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence

from tvist_controller.host import Host
from tvist_server.jobs import Do, Jobs
from tvist_server.lateness import Lateness, Punctuality
from tvist_server.schedule import Schedule

log = logging.getLogger(__name__)

LONGEST_SLEEP = 0.1
"""How long the tick thread sleeps at most without a look at whether it should end [s]."""
HAND_ON_EVERY = 0.0009
"""Time that passes at least between two calls of whoever hands on what robots say [s]. One call costs two changes
of threads, as much as a tick: of a single robot each tick is handed on at once, of several those of a
millisecond together."""
SET_TIMER_SLACK = 29
"""Option of prctl for the timer slack: the largest delay with which a thread may be woken, in nanoseconds."""
PRIORITY = 50
"""Real-time priority of the tick thread: the middle of the range 1 to 99."""


class Mailbox:
    """A robot as a clock drives it: its host, and what waits to be done between two of its ticks.

    Args:
        host: The controller.
    """

    def __init__(self, host: Host) -> None:
        self.host = host
        self.jobs = Jobs()
        self.ending = False
        """Whether a step that is under way has to end."""
        self.lateness = Lateness()

    def post(self, do: Do, client: str | None = None) -> None:
        """Have something done in the controller's thread before its next tick. From any thread; never waits.

        Args:
            do: What is to be done.
            client: Client that sent it, if known.
        """
        self.jobs.post(do, client)

    def attend(self, stepper: str | None) -> bool:
        """Before a tick of a client's step, do what others wait for; whether the step may go on."""
        self.jobs.do_others(stepper)
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
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End, after the job that is being done, a step before its next tick; in real time after all that wait."""
        self._running = False
        for robot in self._robots:
            robot.ending = True
            robot.post(_nothing)
        if self._thread.is_alive():
            self._thread.join()

    @abstractmethod
    def punctuality(self, robot: Mailbox) -> Punctuality | None:
        """Lateness of a robot's ticks since the last look; None where time does not pass by itself."""

    def _guarded(self) -> None:
        try:
            self._run()
        except (
            BaseException
        ):  # whatever somebody's shaper raises: a thread that ends without a word would be worse
            log.exception("the controller's thread ended")
            for robot in self._robots:
                robot.host.failure = "the controller's thread ended by an error: see the log"

    @abstractmethod
    def _run(self) -> None: ...


class Lockstep(Clock):
    """Time passes when a client steps; the last state is told again once a second for those who come late.

    A thread for each robot: a step of one may take long, and clients of another do not wait for it.

    Args:
        robot: The robot.
        repeat: Tells its last state again.
    """

    def __init__(self, robot: Mailbox, repeat: Do) -> None:
        super().__init__([robot])
        self._jobs = robot.jobs
        self._repeat = repeat

    def punctuality(self, robot: Mailbox) -> None:
        """There is none: a client lets time pass."""

    def _run(self) -> None:
        while self._running:
            if not self._jobs.do_next(timeout=1.0):
                self._repeat()


class Realtime(Clock):
    """Ticks at every period of the monotonic clock, for all robots in one thread, by a `Schedule`.

    Args:
        robots: Robots to tick.
        hand_on: Called after ticks, to hand on what the robots said.
        period: Tick [s].
        speed: Simulation speed relative to real time [-].
        priority: Whether to ask the system for real-time priority.
    """

    def __init__(
        self,
        robots: Sequence[Mailbox],
        hand_on: Do,
        period: float,
        speed: float = 1.0,
        *,
        priority: bool = False,
    ) -> None:
        super().__init__(robots)
        self._hand_on = hand_on
        self._period = period / speed
        self._priority = priority

    def punctuality(self, robot: Mailbox) -> Punctuality:
        """Lateness since the last look."""
        return robot.lateness.look()

    def _run(self) -> None:
        _wake_sharply()
        if self._priority:
            _ask_for_priority()
        robots, now, sleep = self._robots, time.monotonic, time.sleep
        alone, handed_on = len(robots) == 1, -HAND_ON_EVERY
        schedule = Schedule(len(robots), self._period, now())
        while self._running:
            wait = schedule.due - now()
            if wait > 0.0:
                sleep(min(wait, LONGEST_SLEEP))
                if wait > LONGEST_SLEEP:
                    continue
            begun = now()
            number, late, missed = schedule.begin(begun)
            robot = robots[number]
            robot.lateness.note(late)
            if missed:
                robot.host.missed(missed)
            robot.jobs.do_waiting()
            robot.host.tick()
            if alone or begun - handed_on >= HAND_ON_EVERY:
                handed_on = begun
                self._hand_on()
        for robot in robots:
            robot.jobs.do_waiting()
        self._hand_on()


def _wake_sharply() -> None:
    """Have the calling thread woken when it asks to be; by default the system may take 50 µs longer."""
    with contextlib.suppress(OSError, AttributeError):  # a system without: ticks are that much later
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, 1, 0, 0, 0)


def _ask_for_priority() -> None:
    """Put the calling thread before all that have no real-time priority; where that may not be, say so and go on."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        log.warning(
            "real-time priority is not permitted (%s), so the control loop runs at normal priority: "
            "it needs CAP_SYS_NICE, or a limit (ulimit -r) of %d",
            error.strerror,
            PRIORITY,
        )


def _nothing() -> None:
    pass
