"""A real robot as a plant that starts ticks but takes no command; a lost connection is retried every 1 s."""

import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from tvist_controller.instruments.motors import joint_ratings
from tvist_controller.kinematics.arm import Arm
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Measurement, PlantError, RealArm, RobotReport
from tvist_protocol.errors import harmless
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_server.rtde.client import Row, RtdeClient, RtdeError
from tvist_server.rtde.wire import Field, WireType
from tvist_server.watching.address import RobotAddress
from tvist_server.watching.connection import ANSWERS, LostError, RtdeConnection, UnreachableError, resolve
from tvist_server.watching.variables import JOINTS, NEEDED, OPTIONAL, RowCount, has_real_payload, report_of

FIRST_ROWS = 25  # number of rows that determine the row rate
INTERVALS = {1: "500", 4: "125"}  # control periods between two rows, and the row rate of such a robot [Hz]
TEXTS = 10  # largest number of the robot's messages passed on per second, and queued for its next row
RETRY = 1.0  # time between two attempts to connect [s]
TELL_EVERY = 1.0  # shortest time between two reports about missing rows [s]
OTHER = 0.03
"""Deviation of the tool position that means another model [m]; calibrations shift it by some millimetres."""


class WatchedRobot(RealArm):
    """Reads one robot's RTDE rows and writes claimed inputs; PlantError if the robot cannot be watched."""

    def __init__(
        self,
        place: RobotAddress,
        description: RobotDescription,
        payload: Payload,  # used if the robot does not report one
        outputs: Mapping[str, Field] = MappingProxyType({}),  # types and ranges of further required variables
        inputs: Mapping[str, WireType] = MappingProxyType({}),  # types of the inputs to claim
    ) -> None:
        model = description.robot.model
        if description.joints != JOINTS:
            raise PlantError(
                f"a robot of UR's has {JOINTS} joints, and a {model} {description.joints}: give --robot the model of "
                f"the robot at {place}"
            )
        self._place, self._model, self.payload = place, model, payload
        self._needed, self._inputs = {**NEEDED, **outputs}, inputs
        self._arm = Arm(description)
        self._constants = [rating.torque_constant for rating in joint_ratings(description)]
        self._reports: deque[tuple[RobotReport, Row]] = deque()
        self._connection: RtdeConnection | None = None
        self.first_rows: list[Row] = []  # rows read before the first tick
        self._checked = False  # whether the present connection has sent a row of the right robot
        self._lost = 0.0, ""  # time [s] and reason of the loss of the connection; empty while connected
        self._retry_at = self._told_at = self._texts_at = 0.0
        self._untold = self._room = self._left_out = 0
        self._notes: list[str] = []
        try:
            self._address = resolve(place)
            self._inspect()
        except LostError as error:
            raise PlantError(f"{error}. {_NEXT}") from error

    def measure(self) -> Measurement:
        return self.last.measured

    def step(self, command: DriveCommand) -> Measurement:
        del command
        return self.last.measured

    def interval(self) -> float:
        return self._interval * PERIOD

    def cycle_report(self) -> RobotReport:
        """Return the next row."""
        if not self._reports:
            raise PlantError(f"the robot at {self._place} has sent no new row")
        self.last, self.newest = self._reports.popleft()
        return self.last

    def wait(self, timeout: float) -> bool:
        """Wait for the next row, at most for `timeout` [s]; connect if there is no connection."""
        if self._reports:
            return True
        if self._connection is None:
            left = self._retry_at - time.monotonic()
            if left > 0.0:
                time.sleep(min(left, timeout))
                return False
            self._connect()
        try:
            for row in self._rows(timeout):
                self._take(row)
        except (LostError, RtdeError) as error:
            self._lose(error)
        return bool(self._reports)

    @property
    def connected(self) -> bool:
        return self._connection is not None

    def write(self, numbers: Sequence[float]) -> None:
        """Write all inputs, in order, if there is a connection."""
        if self._connection is not None:
            self._connection.write(numbers)

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _inspect(self) -> None:
        """Read rows before the server ticks to determine the robot's model and row rate."""
        self._connect()
        rows = self.first_rows
        try:
            ends = time.monotonic() + ANSWERS
            while len(rows) < FIRST_ROWS:
                rows += self._rows(1.0)
                if time.monotonic() > ends:
                    raise LostError(f"{self._place} sends only {len(rows)} rows in {ANSWERS:g} s")
            self._check(rows[-1])
            self.version = self._client.version  # software version: major, minor, bugfix, build
            lacking = self._client.lacking
        finally:
            self.close()
        steps = np.diff([row["timestamp"][0] for row in rows]) / PERIOD
        between = steps[steps > 0.5]
        self._interval = round(float(between.min())) if between.size else 0
        if self._interval not in INTERVALS:
            found = 1.0 / (self._interval * PERIOD) if self._interval else 0.0
            raise LostError(
                f"the robot at {self._place} sends {found:.0f} rows a second: only robots with 125 or 500 can "
                "be watched"
            )
        self._count = RowCount(self._interval)
        self.last, self.newest = self._report(rows[-1], 0), rows[-1]
        software = ".".join(map(str, self.version[:3]))
        rate, done = INTERVALS[self._interval], "moved" if self._inputs else "watched"
        self._notes.append(
            f"the robot at {self._place} (software {software}, {rate} rows a second) is {done}"
        )
        if self._interval > 1:
            self._notes.append(
                "125 rows a second show vibration up to 62.5 Hz: use an external sensor for higher frequencies"
            )
        if not has_real_payload(rows[-1]):
            told = list(rows[-1]["payload_inertia"])
            self._notes.append(
                f"no body can have its payload inertia {told}: 0 is used instead; correct it at the robot"
            )
        if lacking:
            self._notes.append(f"its software does not report {', '.join(lacking)}")

    def _connect(self) -> None:
        client = RtdeClient(self._needed, OPTIONAL, self._inputs)
        self._connection, self._checked = RtdeConnection(self._place, self._address, client), False
        self._client = self._connection.client

    def _rows(self, timeout: float) -> list[Row]:
        """Return the rows that have come, and keep the robot's messages."""
        assert self._connection is not None
        rows, texts = list(self._connection.rows(timeout)), self._connection.texts
        if (now := time.monotonic()) - self._texts_at >= 1.0:
            self._texts_at, self._room = now, TEXTS
            if self._left_out and len(self._notes) < TEXTS:
                self._notes.append(f"{self._left_out} more texts of the robot are left out")
                self._left_out = 0
        kept = texts[: max(0, min(self._room, TEXTS - len(self._notes)))]  # notes wait while no row comes
        self._room, self._left_out = self._room - len(kept), self._left_out + len(texts) - len(kept)
        self._notes += [f"the robot says: {harmless(' '.join(text.split()))}" for text in kept]
        texts.clear()
        return rows

    def _check(self, row: Row) -> None:
        """Raise LostError if the tool's pose contradicts the robot file; only note a missing pose."""
        if "tcp_offset" not in row:
            self._notes.append(
                f"whether it is a {self._model} is unknown, because it does not report its tool"
            )
            return
        tool = self._arm.with_tool(row["tcp_offset"])
        here, there = tool.pose(np.array(row["actual_q"]))[1], np.array(row["actual_TCP_pose"][:3])
        apart = float(np.linalg.norm(here - there))
        if not apart <= OTHER:
            raise LostError(
                f"the robot at {self._place} is no {self._model}: its tool is {1e3 * apart:.0f} mm from where the "
                "robot file has it. Give --robot its model"
            )

    def _take(self, row: Row) -> None:
        now, (lost_at, why) = time.monotonic(), self._lost
        if not self._checked:
            self._check(row)
        counted = self._count.take(row["timestamp"][0], now, reconnected=not self._checked)
        self._checked = True
        if counted is None:
            return
        if why:
            anew = "; its clock began anew, and ours goes on" if counted.anew else ""
            self._notes.append(
                f"the robot at {self._place} is back after {now - lost_at:.1f} s: {counted.missing} rows are "
                f"missing{anew}"
            )
            self._lost = 0.0, ""
        elif counted.missing:
            self._untold += counted.missing
        if self._untold and now - self._told_at >= TELL_EVERY:
            due = self._count.rows + self._count.missing
            self._notes.append(
                f"{self._untold} rows of the robot are missing, {self._count.missing} of {due} since the start: "
                "check the network and the load of this machine"
            )
            self._told_at, self._untold = now, 0
        self._reports.append((self._report(row, counted.tick), row))

    def _report(self, row: Row, tick: int) -> RobotReport:
        report = report_of(row, self._constants, tick, self._count.missing, self._notes)
        self._notes = []
        self.payload = report.payload or self.payload
        return report

    def _lose(self, error: LostError | RtdeError) -> None:
        """Close the connection; report a loss once per reason in an extra tick, but no failed retries."""
        self.close()
        now, why = time.monotonic(), str(error)
        self._retry_at = now + RETRY
        since, before = self._lost
        if why == before or (before and isinstance(error, UnreachableError)):
            return
        self._lost = (since if before else now), why
        latest, row = self._reports[-1] if self._reports else (self.last, self.newest)
        modes = int(RobotMode.DISCONNECTED), int(SafetyMode.UNDEFINED), int(RuntimeState.STOPPED)
        told = (*self._notes, f"{why}; the state stands still, and a connection is attempted every second")
        self._notes = []
        self._reports.append((replace(latest, tick=self._count.silence(), modes=modes, told=told), row))


_NEXT = (
    "Next: see that the robot is on, that this machine reaches its address, and that its RTDE interface is enabled "
    "in its security settings"
)
