"""What is read of a robot, and what it means here."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tvist_plant.description import Payload, is_real_body
from tvist_plant.model import Floats
from tvist_plant.plant import Measurement
from tvist_server.rtde.client import Row
from tvist_server.rtde.wire import Wire

NEEDED: dict[str, Wire] = {
    "timestamp": Wire.DOUBLE,
    "target_q": Wire.VECTOR6D,
    "target_qd": Wire.VECTOR6D,
    "target_qdd": Wire.VECTOR6D,
    "target_moment": Wire.VECTOR6D,
    "actual_q": Wire.VECTOR6D,
    "actual_qd": Wire.VECTOR6D,
    "actual_current": Wire.VECTOR6D,
    "actual_TCP_pose": Wire.VECTOR6D,
    "actual_TCP_force": Wire.VECTOR6D,
    "actual_tool_accelerometer": Wire.VECTOR3D,
    "robot_mode": Wire.INT32,
    "safety_mode": Wire.INT32,
    "runtime_state": Wire.UINT32,
    "speed_scaling": Wire.DOUBLE,
}
"""Variables that every robot with RTDE has."""
OPTIONAL: dict[str, Wire] = {
    "actual_current_as_torque": Wire.VECTOR6D,
    "target_speed_fraction": Wire.DOUBLE,
    "tcp_offset": Wire.VECTOR6D,
    "payload": Wire.DOUBLE,
    "payload_cog": Wire.VECTOR3D,
    "payload_inertia": Wire.VECTOR6D,
    "actual_digital_input_bits": Wire.UINT64,
    "actual_digital_output_bits": Wire.UINT64,
}
"""Variables that older software does not have."""
JOINTS = 6
"""Joints of every robot with RTDE."""
_FINITE = ("actual_q", "actual_qd", "actual_current", "actual_tool_accelerometer", "timestamp", "target_q")


class Values(NamedTuple):
    """A row in our units and orders."""

    measured: Measurement
    """Measurements."""
    target: Floats
    """Position, velocity, acceleration and torque, shape (4, 6)."""
    modes: tuple[int, int, int]
    """Robot mode, safety mode and runtime state."""
    speed: float
    """Share of the programmed speed [-]."""
    payload: Payload | None
    """Payload that the robot was told."""
    tool: tuple[float, ...] | None
    """Tool centre point in the flange frame."""
    force: tuple[float, ...]
    """Force and torque at the tool centre point."""
    slider: float | None
    """Position of the speed slider [-]."""
    inputs: int
    """Digital inputs."""
    outputs: int
    """Digital outputs."""


def is_finite(row: Row) -> bool:
    """Return whether a row has numbers where a state needs some."""
    return all(np.isfinite(row[name]).all() for name in _FINITE)


def values_of(row: Row, constants: Sequence[float]) -> Values:
    """Convert a row.

    Args:
        row: The row.
        constants: Torque over current of each joint, for robots that do not tell torques [N m/A].
    """
    torque = row.get("actual_current_as_torque")
    moment = np.array(row["actual_current"]) * np.array(constants) if torque is None else np.array(torque)
    slider = row.get("target_speed_fraction")
    return Values(
        Measurement(
            np.array(row["actual_q"]),
            np.array(row["actual_qd"]),
            moment,
            np.array(row["actual_tool_accelerometer"]),
            timestamp=row["timestamp"][0],
        ),
        np.array([row[f"target_{name}"] for name in ("q", "qd", "qdd", "moment")]),
        (int(row["robot_mode"][0]), int(row["safety_mode"][0]), int(row["runtime_state"][0])),
        row["speed_scaling"][0],
        _payload(row),
        row.get("tcp_offset"),
        row["actual_TCP_force"],
        None if slider is None else slider[0],
        int(row.get("actual_digital_input_bits", (0,))[0]),
        int(row.get("actual_digital_output_bits", (0,))[0]),
    )


def _payload(row: Row) -> Payload | None:
    """Payload that the robot was told; its inertia is left out where the robot has none, or an impossible one."""
    mass, com = row.get("payload"), row.get("payload_cog")
    if mass is None or com is None:
        return None
    xx, yy, zz, xy, xz, yz = row.get("payload_inertia", (0.0,) * 6)
    inertia = xx, xy, xz, yy, yz, zz
    x, y, z = com
    return Payload(mass=mass[0], com=(x, y, z), inertia=inertia if is_real_body(inertia) else (0.0,) * 6)
