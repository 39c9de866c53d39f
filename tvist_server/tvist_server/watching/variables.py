"""What is read of a robot, and what it means here."""

from collections.abc import Sequence

import numpy as np

from tvist_plant.description import Payload, is_real_body
from tvist_plant.plant import Measurement, Sight
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


def is_finite(row: Row) -> bool:
    """Return whether a row has numbers where a state needs some."""
    return all(np.isfinite(row[name]).all() for name in _FINITE)


def sight_of(row: Row, constants: Sequence[float], tick: int, missed: int, told: Sequence[str] = ()) -> Sight:
    """Return a row in our units and orders.

    Args:
        row: The row.
        constants: Torque over current of each joint, for robots that do not tell torques [N m/A].
        tick: See `Sight`, as for the next two.
        missed: Number of rows that did not arrive.
        told: What people should know.
    """
    torque, slider = row.get("actual_current_as_torque"), row.get("target_speed_fraction")
    moment = np.array(row["actual_current"]) * np.array(constants) if torque is None else np.array(torque)
    angles, rates, felt = (
        np.array(row[name]) for name in ("actual_q", "actual_qd", "actual_tool_accelerometer")
    )
    return Sight(
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
    """Payload that the robot was told; its inertia is left out where the robot has none, or an impossible one."""
    mass, com = row.get("payload"), row.get("payload_cog")
    if mass is None or com is None:
        return None
    x, y, z = com
    inertia = _inertia(row)
    return Payload(mass=mass[0], com=(x, y, z), inertia=inertia if is_real_body(inertia) else (0.0,) * 6)


def has_real_payload(row: Row) -> bool:
    """Return whether a body may have the inertia that the robot was told; one that it does not say is none."""
    return is_real_body(_inertia(row))


def _inertia(row: Row) -> tuple[float, float, float, float, float, float]:
    xx, yy, zz, xy, xz, yz = row.get("payload_inertia", (0.0,) * 6)
    return xx, xy, xz, yy, yz, zz
