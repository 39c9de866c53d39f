"""The real-time interface: 1220 bytes a tick, as UR's description lays them out."""

import struct

import pytest
from tests.controller.robots import cut

from tvist_protocol import commands as c
from tvist_server.gateways.ur.realtime import RealtimeSession, package

from .hosts import host, told

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


def test_a_client_of_software_5_1_finds_its_shorter_package_at_the_beginning(snapshot):
    assert doubles(package(snapshot))[138] == snapshot.safety_status
    assert 4 + 139 * 8 == 1116


def test_the_tool_accelerometer_feels_gravity(ur5e):
    x, y, z = doubles(package(ur5e().tick()))[108:111]
    assert (x * x + y * y + z * z) ** 0.5 == pytest.approx(9.81, abs=0.3)


def test_it_is_packed_once_for_all_clients_of_a_robot(robot, control, snapshots):
    one, other = session(robot, control), session(robot, control)
    assert one.sample(snapshots[3]) is other.sample(snapshots[3])
    assert one.sample(snapshots[4]) != one.sample(snapshots[3])


@pytest.mark.parametrize("joints", [1, 4])
def test_joints_that_are_not_there_are_zero(ur5e, joints):
    arm = cut(joints)
    values = doubles(package(ur5e(arm, q=arm.poses["Q3"]).tick()))
    assert any(values[31 : 31 + joints])
    assert values[31 + joints : 37] == (0.0,) * (6 - joints)


def test_what_is_sent_to_it_is_taken_for_a_script(robot, control):
    interface = session(robot, control)
    for piece in (b"def f():\n  movej([0,", b"0,0,0,0,0])\nen", b"d\n"):
        interface.receive(piece)
    (run,) = control.commands
    assert run.text == "def f():\n  movej([0,0,0,0,0,0])\nend\n"
    interface.receive(b"power off\n")
    assert control.of(c.PowerOff)


def test_the_read_only_port_hears_nothing(robot, control):
    interface = session(robot, control, read_only=True)
    interface.receive(b"power off\ndef f():\nend\n" + bytes(range(256)))
    assert not control.commands
    assert not robot.told


def test_a_program_sent_without_end_is_bounded(robot, control):
    interface = session(robot, control)
    for _ in range(40):
        interface.receive(b"def f():\n" + b"  x = 1\n" * 10_000)
    assert interface._intake.held <= 1 << 20
    assert [one.values["text"].split(":")[0] for one in told(robot)] == ["program_too_long"]
