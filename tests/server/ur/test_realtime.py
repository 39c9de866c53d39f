"""The real-time interface: 1220 bytes a tick in UR's documented layout."""

import re
import struct

import pytest
from tests.controller.robots import cut

from tvist_server.gateways.ur.realtime import RealtimeSession, package

from .hosts import host
from .test_interfaces_document import PAGE


def doubles(data: bytes):
    assert len(data) == 1220
    assert struct.unpack_from(">i", data) == (1220,)
    return struct.unpack(">152d", data[4:])


def test_values_are_at_their_documented_places(snapshots):
    layout = " ".join(PAGE.split()).partition(" (reserved ones are 0): ")[2].partition(".")[0]
    rows = re.findall(r"(\d+)(?:–(\d+))? (?:`(\w+)`|reserved)(?:, |$)", layout)
    for snapshot in snapshots[::10]:
        expected = []
        for first, last, name in rows:
            assert int(first) == len(expected)
            count = int(last or first) + 1 - int(first)
            value = getattr(snapshot, name) if name else [0.0] * count
            expected += value if isinstance(value, list) else [value]
            assert len(expected) == int(first) + count, name
        assert list(doubles(package(snapshot))) == expected


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
