"""A decoder returns a message or raises ProtocolError, whatever the bytes."""

import json
from functools import partial

import jsonschema
import msgpack
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_protocol import ProtocolError, decode, decode_command, decode_reply, encode, refusal
from tvist_protocol.channels import COMMANDS, tag
from tvist_protocol.commands import Setpoint
from tvist_protocol.generate import FOLDER, golden
from tvist_protocol.info import Info
from tvist_protocol.schema import json_schema
from tvist_protocol.stream import Event, State, Telemetry, Truth

DECODERS = (
    decode_command,
    decode_reply,
    *(partial(decode, kind) for kind in (Setpoint, State, Event, Truth, Telemetry, Info)),
)
GOLDEN = [path.with_suffix(".msgpack").read_bytes() for path in golden(FOLDER)]
CLIENTS = [json.loads(path.read_bytes()) for path in golden(FOLDER)]
CLIENTS = [value for value in CLIENTS if value["type"] in {*map(tag, COMMANDS), "setpoint"}]
SCHEMAS = {tag(kind): jsonschema.Draft202012Validator(json_schema(kind)) for kind in (*COMMANDS, Setpoint)}
PROTOCOL_CODES = {"malformed", "unknown_type", "unknown_field", "missing_field", "out_of_range"}

scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8)
    | st.builds(msgpack.ExtType, st.integers(0, 127), st.binary(max_size=8))
    | st.builds(msgpack.Timestamp, st.integers(0, 2**34 - 1), st.integers(0, 10**9 - 1))
)
keys = (
    st.text(max_size=8) | st.integers(-5, 5) | st.booleans() | st.none() | st.binary(max_size=4) | st.floats()
)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(keys, inner, max_size=6),
    max_leaves=20,
)
fields = st.sampled_from(sorted({name for value in CLIENTS for name in value} | {"", "Q", "type "}))
near = st.one_of(
    values,
    st.sampled_from([0, 0.0, -0.0, 1, 1e3, -1e3, 1000.0000001, 0.002, 0.1, float("nan"), float("inf")]),
    st.lists(st.floats() | st.integers(-1000, 1000), max_size=9),
    st.sampled_from([value["type"] for value in CLIENTS]),
)


def decoded(read, data):
    """The message, or None where it was refused as it should be."""
    try:
        return read(data)
    except ProtocolError as error:
        refused = refusal(error)
    assert refused.code in PROTOCOL_CODES
    assert 0 < len(refused.why) < 500
    assert len(encode(refused)) < 2000
    return None


@given(value=values | st.dictionaries(fields | keys, values, max_size=6))
@examples(200)
def test_random_messagepack_decodes_or_raises_a_protocol_error(value):
    for read in DECODERS:
        decoded(read, msgpack.packb(value))


@st.composite
def damaged(draw):
    data = bytearray(draw(st.sampled_from(GOLDEN)))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        cut = draw(st.integers(0, 4))
        data[at : at + cut] = draw(st.binary(max_size=4))
    return bytes(data)


@given(data=damaged() | st.binary(max_size=200))
@examples(800)
def test_damaged_messages_and_random_bytes_decode_or_raise_a_protocol_error(data):
    for read in DECODERS:
        decoded(read, data)


@st.composite
def changed(draw):
    """A golden message of a client's with a field added, replaced or taken away, at any depth."""
    value = json.loads(json.dumps(draw(st.sampled_from(CLIENTS))))
    place = value
    while draw(st.integers(0, 2)) == 0:
        inner = [part for part in children(place) if isinstance(part, dict | list) and part]
        if not inner:
            break
        place = draw(st.sampled_from(inner))
    if isinstance(place, list):
        at = draw(st.integers(0, len(place) - 1))
        place[at : at + draw(st.integers(0, 1))] = draw(st.lists(near, max_size=2))
    elif draw(st.booleans()):
        place.pop(draw(st.sampled_from(sorted(place))))
    else:
        place[draw(st.sampled_from(sorted(place)) | fields)] = draw(near)
    return value


def children(place):
    return list(place.values() if isinstance(place, dict) else place)


@given(value=changed())
@examples(400)
def test_accepted_messages_fit_the_schema_and_survive_a_round_trip(value):
    data = msgpack.packb(value)
    for read in (decode_command, partial(decode, Setpoint)):
        message = decoded(read, data)
        if message is not None:
            SCHEMAS[tag(type(message))].validate(value)
            assert read(encode(message)) == message
