"""Messages as they stand in a recording: exact, and in the form viewers open."""

import json
import math
from typing import get_args

import jsonschema
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol import Command, Event, Io, ProtocolError, SetEstimator, Setpoint, State, Truth
from tvist_protocol.channels import tag
from tvist_protocol.generate import FOLDER
from tvist_protocol.journal import Entry, entry_of, message_of
from tvist_protocol.programs import Interpreter
from tvist_protocol.recorded import JsonReader, to_json, viewer_schema

KINDS = (State, Event, Truth, Io, Entry)


def golden(name, kind):
    return msgspec.json.decode((FOLDER / "fixtures" / "v1" / f"{name}.json").read_bytes(), type=kind)


STATE = golden("state", State)
MESSAGES = [
    STATE,
    msgspec.structs.replace(STATE, setpoint_sequence=None),
    msgspec.structs.replace(STATE, setpoint_sequence=2**64 - 1),
    golden("event", Event),
    Event(tick=1, kind="warning"),
    Event(tick=1, kind="warning", why='a "quoted":null sentence\n'),
    golden("truth", Truth),
    golden("io", Io),
    msgspec.structs.replace(
        golden("io", Io), program="a", interpreter=Interpreter(executed=3), tcp_force_zero=[0.5] * 6
    ),
    Entry(tick=4, kind="client_gone", client="x"),
    Entry(tick=4, kind="missed", count=3),
    Entry(tick=4, kind="setpoint", message={"type": "setpoint", "token": "t", "sequence": 0, "q": [0.5]}),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_recorded_message_is_restored_equal(message):
    back = JsonReader(type(message)).read(to_json(message))
    assert type(back) is type(message)
    assert back == message


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=8))
def test_a_recorded_finite_float_is_restored_bit_for_bit(values):
    back = JsonReader(State).read(to_json(msgspec.structs.replace(STATE, target_q=values)))
    assert [*map(float.hex, back.target_q)] == [*map(float.hex, values)]


def test_a_recorded_infinite_number_is_restored_as_nan():
    state = msgspec.structs.replace(
        STATE, setpoint_sequence=None, actual_q=[1.5, math.nan, math.inf], shaper_delay=-math.inf
    )
    back = JsonReader(State).read(to_json(state))
    assert back.actual_q[0] == 1.5
    assert all(map(math.isnan, (*back.actual_q[1:], back.shaper_delay)))
    assert back.setpoint_sequence is None
    assert back.target_q == state.target_q


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_the_viewer_schema_accepts_recorded_messages(message):
    schema = viewer_schema(type(message))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(json.loads(to_json(message)), schema)


@pytest.mark.parametrize("kind", KINDS)
def test_the_viewer_schema_rejects_other_kinds_of_message(kind):
    for message in MESSAGES:
        if type(message) is not kind:
            with pytest.raises(jsonschema.ValidationError):
                jsonschema.validate(json.loads(to_json(message)), viewer_schema(kind))


@pytest.mark.parametrize("kind", KINDS)
def test_the_viewer_schema_uses_only_what_viewers_support(kind):
    """One plain type a field, properties at every object, no reference: all that Lichtblick knows."""

    def check(schema):
        assert schema["type"] == "object"
        for part in schema["properties"].values():
            assert part["type"] in {"boolean", "string", "number", "integer", "object", "array"}
            if part["type"] == "object":
                check(part)
            if part["type"] == "array":
                assert part["items"]["type"] in {"boolean", "string", "number", "integer"}

    schema = viewer_schema(kind)
    check(schema)
    assert "$ref" not in json.dumps(schema)
    assert "null" not in json.dumps([part.get("type") for part in schema["properties"].values()])
    assert all(part.get("description") for name, part in schema["properties"].items() if name != "type")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "data", [b"", b"{", b"[1]", b"[]", b"3", b"{}", b"\xff\xfe", b'{"type":"done"}', b"null"]
)
def test_invalid_recorded_bytes_raise_a_protocol_error(kind, data):
    with pytest.raises(ProtocolError) as caught:
        JsonReader(kind).read(data)
    assert caught.value.code == "malformed"


def test_fields_of_a_later_version_are_ignored():
    data = to_json(STATE)[:-1] + b',"mood":"good"}'
    assert JsonReader(State).read(data) == STATE


@pytest.mark.parametrize("kind", [*get_args(Command), Setpoint], ids=tag)
def test_every_command_is_restored_equal_from_the_journal(kind):
    for path in (FOLDER / "fixtures" / "v1").glob(f"{tag(kind)}.*json"):
        message = golden(path.stem, kind)
        entry = entry_of(17, message, client="someone")
        assert entry.kind == ("setpoint" if kind is Setpoint else "command")
        read = JsonReader(Entry).read(to_json(entry))
        assert (read.tick, read.client) == (17, "someone")
        back = message_of(read)
        assert type(back) is kind
        assert back == message


@pytest.mark.parametrize("angle", [5e-324, -0.0, 0.1 + 0.2, 1.0, 1e-7, 1000.0, 2.0**-1074 * 3])
def test_a_recorded_set_point_is_restored_bit_for_bit(angle):
    setpoint = Setpoint(token="t", sequence=2**64 - 1, q=(angle,))
    back = message_of(JsonReader(Entry).read(to_json(entry_of(0, setpoint))))
    assert back.sequence == setpoint.sequence
    assert back.q[0].hex() == angle.hex()


def test_a_recorded_calibration_distinguishes_integers_from_floats():
    calibration = {"a": 1, "b": 1.0, "c": 1e22, "d": [True, None, "x", -0.0]}
    command = SetEstimator(token="t", name="polynomial", calibration=calibration)
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
def test_a_journal_entry_without_a_valid_message_is_an_error(entry, code, says):
    with pytest.raises(ProtocolError) as caught:
        message_of(entry)
    assert caught.value.code == code
    assert caught.value.where == "message"
    assert says in caught.value.why
