"""The real-time interface: 1220 bytes a tick, as UR's description lays them out."""

import struct

import pytest
from tests.controller.robots import cut

from tvist_server.gateways.ur.realtime import RealtimeSession, package

from .hosts import host

# Zero-based numbers of doubles, from the description of the interface; counts behind.
PLACES = {
    "timestamp": (0, 1),
    "target_q": (1, 6),
    "target_qd": (7, 6),
    "target_qdd": (13, 6),
    "target_current": (19, 6),
    "target_moment": (25, 6),
    "actual_q": (31, 6),
    "actual_qd": (37, 6),
    "actual_current": (43, 6),
    "joint_control_output": (49, 6),
    "actual_TCP_pose": (55, 6),
    "actual_TCP_speed": (61, 6),
    "actual_TCP_force": (67, 6),
    "target_TCP_pose": (73, 6),
    "target_TCP_speed": (79, 6),
    "actual_digital_input_bits": (85, 1),
    "joint_temperatures": (86, 6),
    "actual_execution_time": (92, 1),
    "robot_mode": (94, 1),
    "joint_mode": (95, 6),
    "safety_mode": (101, 1),
    "actual_tool_accelerometer": (108, 3),
    "speed_scaling": (117, 1),
    "actual_momentum": (118, 1),
    "actual_main_voltage": (121, 1),
    "actual_robot_voltage": (122, 1),
    "actual_robot_current": (123, 1),
    "actual_joint_voltage": (124, 6),
    "actual_digital_output_bits": (130, 1),
    "runtime_state": (131, 1),
    "elbow_position": (132, 3),
    "elbow_velocity": (135, 3),
    "safety_status": (138, 1),
    "payload": (142, 1),
    "payload_cog": (143, 3),
    "payload_inertia": (146, 6),
}


def doubles(data: bytes):
    assert len(data) == 1220
    assert struct.unpack_from(">i", data) == (1220,)
    return struct.unpack(">152d", data[4:])


def session(robot, control, *, read_only=False):
    return RealtimeSession(host(robot), control, pytest.fail, read_only=read_only)


def test_every_value_stands_where_the_description_has_it_to_the_last_bit(snapshots):
    for snapshot in snapshots[::10]:
        values = doubles(package(snapshot))
        reserved = set(range(152))
        for name, (first, count) in PLACES.items():
            value = getattr(snapshot, name)
            assert list(values[first : first + count]) == (value if count > 1 else [value]), name
            reserved -= set(range(first, first + count))
        assert {values[number] for number in reserved} == {0.0}


def test_the_tool_accelerometer_feels_gravity(ur5e):
    x, y, z = doubles(package(ur5e().tick()))[108:111]
    assert (x * x + y * y + z * z) ** 0.5 == pytest.approx(9.81, abs=0.3)


@pytest.mark.parametrize("joints", [1, 4])
def test_joints_that_are_not_there_are_zero(ur5e, joints):
    arm = cut(joints)
    values = doubles(package(ur5e(arm, q=arm.poses["Q3"]).tick()))
    assert any(values[31 : 31 + joints])
    assert values[31 + joints : 37] == (0.0,) * (6 - joints)


def test_the_read_only_port_hears_nothing(robot, control):
    interface = session(robot, control, read_only=True)
    interface.receive(b"power off\ndef f():\nend\n" + bytes(range(256)))
    assert not control.commands
    assert not robot.told
