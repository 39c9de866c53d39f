"""Variables read from a real robot, their conversion, and the control periods that rows belong to."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tvist_plant.description import Payload, is_real_body
from tvist_plant.plant import PERIOD, Measurement, RobotReport
from tvist_server.rtde.client import Row, RtdeError
from tvist_server.rtde.wire import Field, WireType

NEEDED: dict[str, Field] = {
    "timestamp": Field(WireType.DOUBLE, 0.0, 1e9),
    "target_q": Field(WireType.VECTOR6D, -1e3, 1e3),
    "target_qd": Field(WireType.VECTOR6D, -1e3, 1e3),
    "target_qdd": Field(WireType.VECTOR6D, -1e5, 1e5),
    "target_moment": Field(WireType.VECTOR6D, -1e5, 1e5),
    "actual_q": Field(WireType.VECTOR6D, -1e3, 1e3),
    "actual_qd": Field(WireType.VECTOR6D, -1e3, 1e3),
    "actual_current": Field(WireType.VECTOR6D, -1e3, 1e3),
    "actual_TCP_pose": Field(WireType.VECTOR6D, -1e3, 1e3),
    "actual_TCP_force": Field(WireType.VECTOR6D, -1e5, 1e5),
    "actual_tool_accelerometer": Field(WireType.VECTOR3D, -1e4, 1e4),
    "robot_mode": Field(WireType.INT32, -1, 255),
    "safety_mode": Field(WireType.INT32, -1, 255),
    "runtime_state": Field(WireType.UINT32, -1, 255),
    "speed_scaling": Field(WireType.DOUBLE, 0.0, 2.0),
}
"""Variables that every robot with RTDE has; the ranges exclude impossible values."""
OPTIONAL: dict[str, Field] = {
    "actual_current_as_torque": Field(WireType.VECTOR6D, -1e5, 1e5),
    "target_speed_fraction": Field(WireType.DOUBLE, 0.0, 1.0),
    "tcp_offset": Field(WireType.VECTOR6D, -10.0, 10.0),
    "payload": Field(WireType.DOUBLE, 0.0, 100.0),
    "payload_cog": Field(WireType.VECTOR3D, -2.0, 2.0),
    "payload_inertia": Field(WireType.VECTOR6D, -10.0, 10.0),
    "actual_digital_input_bits": Field(WireType.UINT64, 0, 2**32 - 1),
    "actual_digital_output_bits": Field(WireType.UINT64, 0, 2**32 - 1),
}
"""Variables that older software lacks."""
JOINTS = 6  # number of joints of every robot with RTDE
SAME_CLOCK = 1.0
"""Largest lead of a row over earlier ones, and largest difference of the clocks after a lost connection [s]."""


def report_of(
    row: Row, constants: Sequence[float], tick: int, missed: int, told: Sequence[str] = ()
) -> RobotReport:
    """Convert a row to SI units; `constants` are torque constants [N m/A], for robots that report no torques."""
    torque, slider = row.get("actual_current_as_torque"), row.get("target_speed_fraction")
    moment = np.array(row["actual_current"]) * np.array(constants) if torque is None else np.array(torque)
    angles, rates, felt = (
        np.array(row[name]) for name in ("actual_q", "actual_qd", "actual_tool_accelerometer")
    )
    return RobotReport(
        tick,
        Measurement(angles, rates, moment, felt, timestamp=row["timestamp"][0]),
        np.array([row[f"target_{name}"] for name in ("q", "qd", "qdd", "moment")]),
        (int(row["robot_mode"][0]), int(row["safety_mode"][0]), int(row["runtime_state"][0])),
        row["speed_scaling"][0],
        missed,
        payload=_payload(row),
        tool=row.get("tcp_offset"),
        force=row["actual_TCP_force"],
        slider=None if slider is None else slider[0],
        inputs=int(row.get("actual_digital_input_bits", (0,))[0]),
        outputs=int(row.get("actual_digital_output_bits", (0,))[0]),
        told=tuple(told),
    )


def _payload(row: Row) -> Payload | None:
    """Return the payload set on the robot; inertia is 0 if the robot reports none, or an impossible one."""
    mass, com = row.get("payload"), row.get("payload_cog")
    if mass is None or com is None:
        return None
    x, y, z = com
    inertia = _inertia(row)
    return Payload(mass=mass[0], com=(x, y, z), inertia=inertia if is_real_body(inertia) else (0.0,) * 6)


def has_real_payload(row: Row) -> bool:
    """Return whether inertia set on the robot is possible for a body; a missing one counts as possible."""
    return is_real_body(_inertia(row))


def _inertia(row: Row) -> tuple[float, float, float, float, float, float]:
    xx, yy, zz, xy, xz, yz = row.get("payload_inertia", (0.0,) * 6)
    return xx, xy, xz, yy, yz, zz


class Counted(NamedTuple):
    """A new row."""

    tick: int  # number of its control period; it increases from row to row
    missing: int  # number of rows missing before it
    anew: bool  # whether the robot's clock was reset, so that `missing` is estimated from the local clock


class RowCount:
    """Numbers rows by control periods since the robot's clock started; a row comes every `interval` periods.

    If that clock is reset, as by a restart, the numbers continue according to the local clock.
    """

    def __init__(self, interval: int) -> None:
        self._interval = interval
        self._own: int | None = None
        self._offset, self._heard, self._ahead = 0, 0.0, 0.0
        self.tick = 0  # number of the last row; 0 before the first
        self.rows = self.missing = 0  # numbers of rows taken and missing since the first one

    def take(self, timestamp: float, now: float, *, reconnected: bool = False) -> Counted | None:
        """Take a row, timed by the robot's and the local clock [s]; return None if it repeats the last row.

        Raise RtdeError if the robot's time goes back or deviates from the local one, unless the connection
        was lost before.
        """
        own, before = round(timestamp / PERIOD), self._own
        if own == before:
            return None
        missing, anew, ahead = 0, False, timestamp - now
        if before is not None and not reconnected:
            if own < before or ahead > self._ahead + SAME_CLOCK:
                raise RtdeError(f"the robot's timestamp goes from {before * PERIOD:g} to {timestamp:g} s")
            ahead = max(ahead, self._ahead)
        if before is not None:
            passed, elapsed = own - before, round((now - self._heard) / PERIOD)
            anew = passed < 0 or (reconnected and abs(passed - elapsed) > SAME_CLOCK / PERIOD)
            if anew:
                passed = max(1, elapsed)
                self._offset = self.tick + passed - own
            missing = max(0, round(passed / self._interval) - 1)
        self._own, self._heard, self._ahead = own, now, ahead
        self.tick = max(own + self._offset, self.tick + 1)
        self.rows += 1
        self.missing += missing
        return Counted(self.tick, missing, anew)

    def silence(self) -> int:
        """Count a control period without a row, in which the robot's loss is reported; return its number."""
        self.tick += 1
        return self.tick
