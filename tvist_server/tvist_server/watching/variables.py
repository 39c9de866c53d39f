"""What is read of a robot, and what it means here."""

from collections.abc import Sequence

import numpy as np

from tvist_plant.description import Payload, is_real_body
from tvist_plant.plant import Measurement, Sight
from tvist_server.rtde.client import Row
from tvist_server.rtde.wire import Field, Wire

NEEDED: dict[str, Field] = {
    "timestamp": Field(Wire.DOUBLE, 0.0, 1e9),
    "target_q": Field(Wire.VECTOR6D, -1e3, 1e3),
    "target_qd": Field(Wire.VECTOR6D, -1e3, 1e3),
    "target_qdd": Field(Wire.VECTOR6D, -1e5, 1e5),
    "target_moment": Field(Wire.VECTOR6D, -1e5, 1e5),
    "actual_q": Field(Wire.VECTOR6D, -1e3, 1e3),
    "actual_qd": Field(Wire.VECTOR6D, -1e3, 1e3),
    "actual_current": Field(Wire.VECTOR6D, -1e3, 1e3),
    "actual_TCP_pose": Field(Wire.VECTOR6D, -1e3, 1e3),
    "actual_TCP_force": Field(Wire.VECTOR6D, -1e5, 1e5),
    "actual_tool_accelerometer": Field(Wire.VECTOR3D, -1e4, 1e4),
    "robot_mode": Field(Wire.INT32, -1, 255),
    "safety_mode": Field(Wire.INT32, -1, 255),
    "runtime_state": Field(Wire.UINT32, -1, 255),
    "speed_scaling": Field(Wire.DOUBLE, 0.0, 2.0),
}
"""Variables that every robot with RTDE has. The ranges exclude what no robot can mean."""
OPTIONAL: dict[str, Field] = {
    "actual_current_as_torque": Field(Wire.VECTOR6D, -1e5, 1e5),
    "target_speed_fraction": Field(Wire.DOUBLE, 0.0, 1.0),
    "tcp_offset": Field(Wire.VECTOR6D, -10.0, 10.0),
    "payload": Field(Wire.DOUBLE, 0.0, 100.0),
    "payload_cog": Field(Wire.VECTOR3D, -2.0, 2.0),
    "payload_inertia": Field(Wire.VECTOR6D, -10.0, 10.0),
    "actual_digital_input_bits": Field(Wire.UINT64, 0, 2**32 - 1),
    "actual_digital_output_bits": Field(Wire.UINT64, 0, 2**32 - 1),
}
"""Variables that older software does not have."""
JOINTS = 6
"""Joints of every robot with RTDE."""


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
