"""What reached a controller comes out of its journal as it went in."""

from typing import get_args

import msgspec
import pytest

from tvist_protocol import Command, MoveJ, ProtocolError, Setpoint, decode, decode_command
from tvist_protocol.channels import tag
from tvist_protocol.generate import FOLDER
from tvist_protocol.journal import Entry, entry_of, message_of
from tvist_protocol.recorded import JsonReader, to_json

COMMAND_TAGS = {tag(kind) for kind in get_args(Command)}


def golden_messages():
    for path in sorted((FOLDER / "fixtures" / "v1").glob("*.msgpack")):
        data = path.read_bytes()
        name = msgspec.msgpack.decode(data)["type"]
        if name in COMMAND_TAGS:
            yield pytest.param(decode_command(data), id=path.stem)
        elif name == "setpoint":
            yield pytest.param(decode(Setpoint, data), id=path.stem)


@pytest.mark.parametrize("message", list(golden_messages()))
def test_every_command_comes_back_equal_from_a_recorded_entry(message):
    entry = entry_of(17, message, client="someone")
    assert entry.kind == ("setpoint" if isinstance(message, Setpoint) else "command")
    read = JsonReader(Entry).read(to_json(entry))
    assert (read.tick, read.client) == (17, "someone")
    back = message_of(read)
    assert type(back) is type(message)
    assert back == message


@pytest.mark.parametrize("angle", [5e-324, -0.0, 0.1 + 0.2, 1.0, 1e-7, 1000.0, 2.0**-1074 * 3])
def test_a_recorded_set_point_keeps_every_bit(angle):
    setpoint = Setpoint(token="t", sequence=2**64 - 1, q=(angle,))
    back = message_of(JsonReader(Entry).read(to_json(entry_of(0, setpoint))))
    assert back.sequence == setpoint.sequence
    assert back.q[0].hex() == angle.hex()


def test_a_calibration_keeps_the_difference_between_integers_and_floats():
    command = decode_command(
        msgspec.msgpack.encode(
            {
                "type": "set_estimator",
                "token": "t",
                "name": "polynomial",
                "calibration": {"a": 1, "b": 1.0, "c": 1e22, "d": [True, None, "x", -0.0]},
            }
        )
    )
    back = message_of(JsonReader(Entry).read(to_json(entry_of(0, command))))
    assert repr(back.calibration) == repr(command.calibration)


@pytest.mark.parametrize(
    ("entry", "code", "says"),
    [
        (Entry(tick=3, kind="missed", count=2), "missing_field", "missed before tick 3 has no message"),
        (Entry(tick=3, kind="command", message={"type": "fly"}), "malformed", "command before tick 3"),
        (Entry(tick=3, kind="setpoint", message={"type": "stop"}), "malformed", "setpoint before tick 3"),
        (
            Entry(tick=3, kind="command", message={"type": "move_j", "token": "t"}),
            "malformed",
            "q is missing",
        ),
    ],
)
def test_an_entry_that_holds_no_message_says_so(entry, code, says):
    with pytest.raises(ProtocolError) as caught:
        message_of(entry)
    assert caught.value.code == code
    assert caught.value.where == "message"
    assert says in caught.value.why


def test_a_calibration_that_no_client_could_send_is_refused():
    nan = float("nan")
    message = {"type": "set_estimator", "token": "t", "name": "polynomial", "calibration": {"a": nan}}
    with pytest.raises(ProtocolError) as caught:
        message_of(Entry(tick=0, kind="command", message=message))
    assert caught.value.code == "out_of_range"


def test_a_message_in_an_entry_is_plain():
    message = entry_of(0, MoveJ(token="t", q=(1.0, 2.0))).message
    assert message == {
        "type": "move_j",
        "token": "t",
        "q": (1.0, 2.0),
        "velocity": 1.5,
        "acceleration": 2.0,
        "jerk": 100.0,
        "duration": None,
    }
