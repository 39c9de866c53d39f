"""The RTDE client and the count of its rows, without a socket or a clock."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_server.rtde.client import RtdeClient, RtdeError
from tvist_server.rtde.codec import PackageKind, package
from tvist_server.rtde.wire import Field, WireType
from tvist_server.watching.variables import RowCount

NEEDED = {"timestamp": Field(WireType.DOUBLE), "q": Field(WireType.VECTOR3D)}
OPTIONAL = {"payload": Field(WireType.DOUBLE)}


def answers(types):
    head = package(PackageKind.REQUEST_PROTOCOL_VERSION, b"\x01")
    version = package(PackageKind.GET_URCONTROL_VERSION, struct.pack(">4I", 5, 22, 0, 1))
    return [head, version, package(PackageKind.SETUP_OUTPUTS, b"\x01" + types)]


def set_up(client, outputs, inputs):
    """Answer a client's set-up with the types of its variables."""
    for answer in (*answers(outputs), package(PackageKind.SETUP_INPUTS, b"\x07" + inputs)):
        client.receive(answer)


def data(*numbers):
    return package(PackageKind.DATA, b"\x01" + struct.pack(f">{len(numbers)}d", *numbers))


@examples(40)
@given(st.lists(st.lists(st.floats(-1e6, 1e6), min_size=5, max_size=5), max_size=20), st.integers(1, 200))
def test_rows_do_not_depend_on_how_bytes_are_split(rows, size):
    client = RtdeClient(NEEDED, OPTIONAL)
    begin = [*answers(b"DOUBLE,VECTOR3D,DOUBLE"), package(PackageKind.START, b"\x01")]
    stream = b"".join([*begin, *(data(*row) for row in rows)])
    found = [row for at in range(0, len(stream), size) for row in client.receive(stream[at : at + size]).rows]
    assert client.started
    assert [[*row["timestamp"], *row["q"], *row["payload"]] for row in found] == rows


def test_optional_variables_that_a_robot_lacks_are_left_out():
    client = RtdeClient(NEEDED, OPTIONAL)
    head, version, recipe = answers(b"DOUBLE,VECTOR3D,NOT_FOUND")
    client.receive(head + version)
    assert client.receive(recipe).send.endswith(b"timestamp,q")
    assert client.receive(answers(b"DOUBLE,VECTOR3D")[2]).send == package(PackageKind.START)
    assert client.lacking == ["payload"]


KNOWN = b"DOUBLE,VECTOR3D,DOUBLE"


@pytest.mark.parametrize(
    ("outputs", "inputs", "words"),
    [
        (b"DOUBLE,NOT_FOUND,DOUBLE", b"", "does not know q"),
        (b"DOUBLE,VECTOR6D,DOUBLE", b"", "VECTOR3D"),
        (b"DOUBLE", b"", "1 types"),
        (KNOWN, b"IN_USE,DOUBLE", "another client holds its inputs n to n"),
        (KNOWN, b"NOT_FOUND,NOT_FOUND", "does not know its inputs n to r"),
        (KNOWN, b"DOUBLE,DOUBLE", "input n is not of type INT32"),
        (KNOWN, b"INT32", "1 types for 2 inputs"),
    ],
)
def test_an_unusable_recipe_is_refused(outputs, inputs, words):
    client = RtdeClient(NEEDED, OPTIONAL, {"n": WireType.INT32, "r": WireType.DOUBLE})
    with pytest.raises(RtdeError, match=words):
        set_up(client, outputs, inputs)


@examples(40)
@given(st.lists(st.integers(0, 9), min_size=1, max_size=200), st.sampled_from([1, 4]), st.floats(0.0, 9.0))
def test_received_and_missing_rows_add_up_to_the_robots_time(gaps, interval, jitter):
    """A gap of 0 repeats a row; the arrival times do not matter."""
    count, time = RowCount(interval), 1000
    count.take(0.002 * time, 0.0)
    ticks = [count.tick]
    for gap in gaps:
        time += gap * interval
        counted = count.take(0.002 * time, jitter)
        if counted is not None:
            ticks.append(counted.tick)
    assert ticks == sorted(set(ticks))
    assert ticks[-1] == time
    assert count.rows + count.missing == (time - 1000) // interval + 1


@pytest.mark.parametrize("own", [3.0, 5000.0])
def test_after_a_restart_of_the_robot_ticks_follow_the_local_clock(own):
    count = RowCount(1)
    count.take(100.0, 50.0)
    count.silence()
    counted = count.take(own, 53.0, reconnected=True)
    assert counted.anew
    assert counted.missing == pytest.approx(1500, abs=2)
    assert counted.tick == pytest.approx(50_000 + 1500, abs=2)
    assert count.take(own + 0.002, 53.002).tick == counted.tick + 1
