"""The real-time interface: 1220 bytes a tick in UR's documented layout."""

import re
import struct
from pathlib import Path

import pytest
from tests.controller.robots import cut

from tvist_server.gateways.ur.realtime import RealtimeSession, package

from .hosts import host

PAGE = Path(__file__).parents[3] / "docs/reference/ur-interfaces.md"


@pytest.fixture(scope="module")
def documented():
    """First and last number of each value in the package, and its name, empty if it is reserved."""
    words = " ".join(PAGE.read_text(encoding="utf-8").split())
    layout = words.partition(" (reserved ones are 0): ")[2].partition(".")[0]
    rows = re.findall(r"(\d+)(?:–(\d+))? (?:`(\w+)`|reserved)(?:, |$)", layout)
    return [(int(first), int(last or first), name) for first, last, name in rows]


def doubles(data: bytes):
    assert len(data) == 1220
    assert struct.unpack_from(">i", data) == (1220,)
    return struct.unpack(">152d", data[4:])


def test_values_are_at_their_documented_places(documented, snapshots):
    for snapshot in snapshots[::10]:
        expected = []
        for first, last, name in documented:
            assert first == len(expected)
            value = getattr(snapshot, name) if name else [0.0] * (last - first + 1)
            expected += value if isinstance(value, list) else [value]
            assert len(expected) == last + 1, name
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
