"""A real robot that tvist moves: a plant whose drives belong to another controller."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.plant import PERIOD, Condition, Halt, Measurement, PlantError, RealArm, RobotReport
from tvist_protocol.modes import RuntimeState, SafetyMode
from tvist_server.moving.checks import (
    FELL_SILENT,
    QUESTIONS,
    Expected,
    mounting_trouble,
    tells_gravity,
    version_trouble,
    why_not_by_answers,
    why_not_by_state,
)
from tvist_server.moving.interfaces import configuration_of, narrow_limits, query_dashboard
from tvist_server.moving.program import INPUTS, OUTPUTS
from tvist_server.moving.run import ProgramRun
from tvist_server.moving.servo_lag import ServoLag
from tvist_server.watching.address import RobotAddress
from tvist_server.watching.watched_robot import WatchedRobot

NUMBERS = 1_000_000_000
"""ProgramRun numbers start with the time in microseconds, so that those of two processes differ."""
SILENT = 0.08
"""Time without an RTDE row after which the robot counts as silent [s]; its program brakes much earlier."""
MAX_CAUGHT_UP = 50
"""Largest number of periods made up for after a gap in the rows; after a longer gap, they are skipped."""


class MovedRobot(RealArm):
    """Moves one robot. If the robot must not be moved, raises PlantError with the reason and the remedy."""

    def __init__(
        self,
        place: RobotAddress,
        description: RobotDescription,
        payload: Payload,  # payload that must be set on the robot
        *,
        speed_cap: float,  # largest speed of every joint [rad/s]
        tool: tuple[float, ...] | None = None,  # tool centre point that must be set on it; None: any
        start: tuple[float, ...] | None = None,  # joint angles where it must be [rad]; None: any
        lag: ServoLag | None = None,  # lag of its `servoj`, to be compensated; None: unknown
    ) -> None:
        self._robot = WatchedRobot(place, description, payload, OUTPUTS, INPUTS)
        self._place = place
        self._report = self._robot.last
        self._told = [f"no joint moves faster than {speed_cap:g} rad/s (--speed-cap)"]
        own = configuration_of(place)
        answers = query_dashboard(place, QUESTIONS)
        file = Expected(description, payload, tool, start)
        self._refuse_if(version_trouble(self._robot.version) or why_not_by_answers(file, answers, own))
        self._expected = file._replace(description=narrow_limits(description, own, speed_cap))
        self._refuse_if(why_not_by_state(self._expected, self._report))
        felt = np.mean([row["actual_tool_accelerometer"] for row in self._robot.first_rows], axis=0)
        if tells_gravity(felt):
            self._refuse_if(mounting_trouble(description, self._report.measured.q, felt))
        else:
            self._told.append("its accelerometer does not measure gravity: its mounting was not checked")
        self._expected = self._expected._replace(q=None)  # matters only before the first motion
        if own is None:
            self._told.append("its primary interface reports no limits: only those of the robot file apply")
        if not answers:
            self._told.append("it has no dashboard: model and remote control were not checked")
        self._pace, self._number = ControlPeriods(), time.monotonic_ns() // 1000 % NUMBERS
        self._held, self._lag, self._interval = False, lag, round(self._robot.interval() / PERIOD)
        self._run: ProgramRun | None = None
        self._halt: Halt | None = None
        self._left_paused = False
        """Whether a safety stop has paused our program on the robot, so that it may be replaced."""

    def _refuse_if(self, trouble: str | None) -> None:
        if trouble is not None:
            raise PlantError(f"the robot at {self._place} is not moved: {trouble}")

    @property
    def payload(self) -> Payload:  # type: ignore[override]
        """Payload that is set on the robot."""
        return self._robot.payload

    def described(self) -> RobotDescription:
        return self._expected.description

    def measure(self) -> Measurement:
        """Return the posture the robot's controller holds; PlantError if the robot must not be moved now."""
        run = self._run
        if run is None or not run.ready:
            may_play = run is not None or self._left_paused
            self._refuse_if(why_not_by_state(self._expected, self._report, may_play=may_play))
        last = None if run is None else run.last
        return self._measured(last or self._robot.newest["target_q"])

    def step(self, command: DriveCommand) -> Measurement:
        """Queue a set-point, return the latest measurements; of periods made up for, only the last sends."""
        if self._run is not None:
            self._run.add(command, played=(self._pace.tick - self._report.tick) % self._interval == 0)
            if not self._pace.owed:
                self._run.write()
        return self._measured(self._report.measured.q)

    def _measured(self, q: Floats | Sequence[float]) -> Measurement:
        """Return the latest measurements, but with `q` as posture and the time of the present period."""
        felt = self._report.measured
        return Measurement(
            np.array(q), felt.qd, felt.moment, felt.accelerometer, timestamp=self._pace.tick * PERIOD
        )

    def latest_report(self) -> RobotReport:
        """Return the robot's last row, with the messages for users since the last call."""
        told, self._told = (*self._told,), []
        return replace(self._report, told=told)

    def wait(self, timeout: float) -> bool:
        """Wait for the next period, according to the robot's clock, or to this machine's while the robot is silent."""
        until = time.monotonic() + timeout
        while (now := time.monotonic()) < until:
            if self._pace.next(now):
                return True
            if self._robot.wait(min(self._pace.until(now), until - now)):
                if self._take(self._robot.cycle_report()):
                    return True
            elif self._run is not None and self._pace.silent(time.monotonic()) and not self._robot.wait(0.0):
                # The last check: this process may have been suspended, with rows waiting to be read.
                self._let_go(FELL_SILENT)
        return self._pace.next(time.monotonic())

    def _take(self, report: RobotReport) -> bool:
        self._report = report
        self._told += report.told
        if not self._robot.connected:
            if self._held:
                self._let_go(FELL_SILENT)
            return False
        if self._held and self._run is None:
            trouble = self._trouble()
            if trouble is None:
                self._number += 1
                limits = self._expected.description.limits
                self._run = ProgramRun(
                    self._robot, self._place, self._number, limits, self._lag, self._trouble
                )
            else:  # something has changed since the last check
                self._let_go(Halt(trouble, report.modes[1]))
        self._left_paused &= report.modes[2] in {RuntimeState.PAUSING, RuntimeState.PAUSED}
        if self._run is not None:
            told = self._run.take(report)
            self._told += [] if told is None else [told]
            if self._run.halt is not None:
                self._let_go(self._run.halt)
        return self._pace.row(report.tick, time.monotonic())

    def _trouble(self) -> str | None:
        return why_not_by_state(self._expected, self._report, may_play=self._left_paused)

    @property
    def condition(self) -> Condition:
        return Condition(self._run is not None and self._run.ready, halt=self._halt)

    def switch(self, *, power: bool, brakes: bool) -> None:
        """Start or end the program. Power and brakes themselves are switched by people at the robot."""
        self.stop()
        self._held = power and not brakes

    def stop(self) -> None:
        """Make the program brake and end."""
        if self._run is not None:
            self._run.end()
        self._run, self._held, self._halt = None, False, None

    def close(self) -> None:
        self.stop()
        self._robot.close()

    def _let_go(self, halt: Halt) -> None:
        self.stop()
        self._left_paused = halt.safety_mode not in {SafetyMode.NORMAL, SafetyMode.UNDEFINED}
        self._halt = Halt(f"the robot at {self._place} does not follow: {halt.why}", halt.safety_mode)


class ControlPeriods:
    """Counts one robot's control periods: by its RTDE rows, or while it is silent by this machine's clock."""

    def __init__(self) -> None:
        self.tick = 0  # number of the present period, in the robot's time
        self.owed = 0  # number of periods up to the last row that are not computed yet
        self._heard, self._due = -math.inf, 0.0

    def silent(self, now: float) -> bool:
        """Return whether the robot is silent at the local time `now` [s]."""
        return now - self._heard > SILENT

    def until(self, now: float) -> float:
        """Return how long to wait for rows [s]: until a local period is due or the robot counts as silent."""
        return max(0.0, (self._due if self.silent(now) else self._heard + SILENT) - now)

    def row(self, tick: int, now: float) -> bool:
        """Take a row; return whether a period starts, which is false if the local clock has counted it."""
        self._heard = now
        passed = tick - self.tick
        if passed <= 0:
            return False
        self.owed = passed if passed <= MAX_CAUGHT_UP else 1
        self.tick = tick - self.owed
        return self.next(now)

    def next(self, now: float) -> bool:
        """If a period is owed, or due by the local clock while the robot is silent, start it; return True."""
        if self.owed:
            self.owed -= 1
        elif self.silent(now) and now >= self._due:
            self._due = max(self._due + PERIOD, now - PERIOD)
        else:
            return False
        self.tick += 1
        return True
