"""Clocks of served robots: the wall clock or a client's steps. Only a clock's thread uses its controllers."""

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
from tvist_server.lateness import Lateness
from tvist_server.punctual import PRIORITY, take_priority
from tvist_server.schedule import ExternalTicks, Schedule
from tvist_server.tick_counts import TickCounts

log = logging.getLogger(__name__)

LONGEST_SLEEP = 0.1  # longest sleep of the tick thread before it checks whether it should end [s]
LONGEST_TICK = 1.5
"""Longest wait for a tick at shutdown [s]: a plug-in arm, or in lockstep a client, may block it for ever."""
REPEAT_EVERY = 1.0  # time without a step after which a robot in lockstep republishes its last state [s]
SET_TIMER_SLACK = 29  # `prctl` option: timer slack, the largest delay of a wake-up [ns]


class TickedRobot:
    """A robot as a clock sees it: its host, and the jobs to do between two ticks."""

    def __init__(
        self,
        host: Host,
        patience: Callable[[], float] = float,  # how long a step may wait for a socket [s]
        pace: Callable[[float], bool] | None = None,  # waits up to a time [s] for the arm's tick
        interval: float | None = None,  # tick of an arm that counts its own missed ticks [s]
    ) -> None:
        self.host, self.pace, self.interval = host, pace, interval
        self._patience = patience
        self.jobs = Jobs()
        self.ending = False  # whether a step in progress must end
        self.lateness = Lateness()
        self.overload: TickCounts | None = None  # counts missed ticks; None if a client advances time

    def post(self, do: Do, client: str | None = None) -> None:
        """Queue a job of `client`, done before the next tick. Any thread may call this; it does not block."""
        self.jobs.post(do, client)

    def guarded(self, do: Do) -> None:
        """Run a function; if it raises an exception, end only this robot."""
        try:
            do()
        except Exception:
            log.exception("a robot has stopped ticking")
            self.end("the robot has stopped ticking because of an error: see the log")

    def turn(self) -> None:
        """Do the waiting jobs and tick."""
        self.guarded(self.jobs.do_waiting)
        if self.host.failure is None:
            self.guarded(self.host.tick)

    def end(self, why: str) -> None:
        """Stop ticking and release the arm."""
        self.host.failure = why
        with contextlib.suppress(Exception):  # every arm must be released, whatever happens to the others
            self.host.leave_arm()

    def attend(self, stepper: str | None) -> bool:
        """Between ticks of a step, do other clients' jobs and wait for sockets; return whether it goes on."""
        self.jobs.do_others(stepper)
        while not self.ending and (left := self._patience()) > 0.0:
            self.jobs.do_next_other(stepper, left)
        return not self.ending


class Clock(ABC):
    """A thread that runs the robots' jobs and ticks."""

    def __init__(self, robots: Sequence[TickedRobot]) -> None:
        self._robots = robots
        self._running = True
        self._thread = threading.Thread(target=self._guarded, name="tvist-tick", daemon=True)

    def start(self) -> None:
        """Start to run jobs and to tick."""
        self._thread.start()

    def close(self) -> None:
        """End the thread.

        In lockstep, a step in progress ends before its next tick; else waiting jobs are done first.
        If an arm or a stalled client blocks the thread, the thread is left running until the process ends.
        """
        self._running = False
        for robot in self._robots:
            robot.ending = True
            robot.post(lambda: None)
        if self._thread.is_alive():
            self._thread.join(LONGEST_TICK)
            if self._thread.is_alive():
                log.error(
                    "a tick, a call of the arm or a wait for a client has not returned for %g s", LONGEST_TICK
                )

    def _guarded(self) -> None:
        try:
            self._run()
        except BaseException:  # the thread must not end silently
            log.exception("the controller's thread ended")
            for robot in self._robots:
                robot.end("the controller's thread has ended because of an error: see the log")

    @abstractmethod
    def _run(self) -> None: ...


class Lockstep(Clock):
    """A clock that a client steps. Every robot has its own thread, since a step can take long.

    If nobody steps, `repeat` republishes the last state every second, for new clients.
    """

    def __init__(self, robot: TickedRobot, repeat: Do) -> None:
        super().__init__([robot])
        self._repeat = repeat

    def _run(self) -> None:
        # The deadline is absolute, because other jobs, such as telemetry, may also arrive every second.
        (robot,) = self._robots
        due = time.monotonic() + REPEAT_EVERY
        while self._running:
            robot.guarded(partial(robot.jobs.do_next, max(0.0, due - time.monotonic())))
            if self._running and time.monotonic() >= due:
                self._repeat()
                due = time.monotonic() + REPEAT_EVERY


class Realtime(Clock):
    """Ticks all robots in one thread, at each period of the monotonic clock, or when a plant's arm ticks."""

    def __init__(
        self,
        robots: Sequence[TickedRobot],
        period: float,  # [s]
        speed: float = 1.0,  # simulation time per real time [-]
        *,
        priority: bool = False,  # whether to request real-time priority
    ) -> None:
        super().__init__(robots)
        self._period = period / speed
        self._overloads = [TickCounts(robot.interval or self._period) for robot in robots]
        for robot, overload in zip(robots, self._overloads, strict=True):
            robot.overload = overload
        self._priority = priority
        self._asked = threading.Event()
        self.granted: list[str] = []  # what the system granted to the thread; complete after `start`

    def start(self) -> None:
        """Start the thread, and wait until its priority and its timer slack are set."""
        super().start()
        self._asked.wait()

    def _run(self) -> None:
        try:
            _set_timer_slack()
            if self._priority and take_priority():
                self.granted.append(f"real-time priority {PRIORITY}")
        finally:
            self._asked.set()
        robots, overloads, now, sleep = self._robots, self._overloads, time.monotonic, time.sleep
        pace, silent = robots[0].pace, False
        schedule: Schedule | ExternalTicks = (
            Schedule(len(robots), self._period, now())
            if pace is None
            else ExternalTicks(robots[0].interval or self._period, now(), counts=robots[0].interval is None)
        )
        while self._running:
            if pace is not None:
                if not self._wait_for_tick(robots[0], pace):
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
            if missed:
                robot.host.missed(missed)
            told = overloads[number].note(missed)
            if told is not None:
                robot.host.warn(told)
            robot.turn()
            robot.lateness.note(late, now() - begun)
        for robot in robots:
            robot.guarded(robot.jobs.do_waiting)

    def _wait_for_tick(self, robot: TickedRobot, pace: Callable[[float], bool]) -> bool:
        """Wait for the arm's next tick. If the arm fails, this clock gives the tick, so that the robot can stop."""
        try:
            return pace(LONGEST_SLEEP)
        except PlantError as error:
            robot.host.fail(str(error))
            time.sleep(self._period)
            return True

    def _do_without_tick(self, robot: TickedRobot, silent: bool) -> bool:
        """While no tick comes, answer clients, and warn them unless `silent` (warned before); return True."""
        robot.guarded(robot.jobs.do_waiting)
        if not silent and robot.interval is None:  # a watched robot reports by itself that it is lost
            robot.host.warn(
                "the arm does not begin its next tick: time stands still, and commands have no effect"
            )
        return True


def _set_timer_slack() -> None:
    """Request exact wake-ups of the calling thread; by default Linux may delay them by 50 µs."""
    with contextlib.suppress(OSError, AttributeError):  # other systems: ticks are later by that much
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, 1, 0, 0, 0)
