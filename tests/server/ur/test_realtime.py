"""The real-time interface: 1220 bytes a tick in UR's documented layout."""

import struct

import pytest
from tests.controller.robots import cut

from tvist_server.gateways.ur.realtime import RealtimeSession, package

from .hosts import host

# Zero-based numbers of doubles, from the description of the interface; counts behind.
PLACES = """
0 1 timestamp, 1 6 target_q, 7 6 target_qd, 13 6 target_qdd, 19 6 target_current, 25 6 target_moment, 31 6 actual_q,
37 6 actual_qd, 43 6 actual_current, 49 6 joint_control_output, 55 6 actual_TCP_pose, 61 6 actual_TCP_speed,
67 6 actual_TCP_force, 73 6 target_TCP_pose, 79 6 target_TCP_speed, 85 1 actual_digital_input_bits,
86 6 joint_temperatures, 92 1 actual_execution_time, 94 1 robot_mode, 95 6 joint_mode, 101 1 safety_mode,
108 3 actual_tool_accelerometer, 117 1 speed_scaling, 118 1 actual_momentum, 121 1 actual_main_voltage,
122 1 actual_robot_voltage, 123 1 actual_robot_current, 124 6 actual_joint_voltage, 130 1 actual_digital_output_bits,
131 1 runtime_state, 132 3 elbow_position, 135 3 elbow_velocity, 138 1 safety_status, 142 1 payload,
143 3 payload_cog, 146 6 payload_inertia
"""


def doubles(data: bytes):
    assert len(data) == 1220
    assert struct.unpack_from(">i", data) == (1220,)
    return struct.unpack(">152d", data[4:])


def test_values_are_at_their_documented_places(snapshots):
    for snapshot in snapshots[::10]:
        values = doubles(package(snapshot))
        reserved = set(range(152))
        for first, count, name in (
            (int(a), int(b), name) for a, b, name in map(str.split, PLACES.split(","))
        ):
            value = getattr(snapshot, name)
            assert list(values[first : first + count]) == (value if count > 1 else [value]), name
            reserved -= set(range(first, first + count))
        assert {values[number] for number in reserved} == {0.0}


def test_missing_joints_are_zero(ur5e):
    arm = cut(4)
    values = doubles(package(ur5e(arm, q=arm.poses["Q3"]).tick()))
    assert any(values[31:35])
    assert values[35:37] == (0.0, 0.0)


def test_the_read_only_port_ignores_input(robot, control):
    interface = RealtimeSession(host(robot), control, pytest.fail, read_only=True)
    interface.receive(b"power off\ndef f():\nend\n" + bytes(range(256)))
    assert not control.commands
    assert not robot.told
