"""The golden messages are the contract: JSON by hand, MessagePack by another codec than ours."""

import json
import types
from functools import partial

import msgpack
import msgspec
import pytest

from tvist_protocol import check, codec, decode, decode_command, decode_reply, encode
from tvist_protocol.channels import COMMANDS, MESSAGES, REPLIES, tag
from tvist_protocol.generate import FOLDER, golden

GOLDEN = golden(FOLDER)
TYPES = {tag(kind): kind for kind in MESSAGES}
DECODERS = {tag(kind): partial(decode, kind) for kind in MESSAGES}
DECODERS |= {tag(kind): decode_command for kind in COMMANDS} | {tag(kind): decode_reply for kind in REPLIES}


def written(path):
    return json.loads(path.read_bytes())


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_golden_bytes_and_json_are_one_message_for_both_codecs(path):
    value = written(path)
    message, read = msgspec.convert(value, TYPES[value["type"]]), DECODERS[value["type"]]
    for data in (path.with_suffix(".msgpack").read_bytes(), encode(message)):
        assert read(data) == message
        assert type(read(data)) is TYPES[value["type"]]
    assert check(message) == message
    other = msgpack.unpackb(encode(message))
    defaults = {name: other[name] for name in other.keys() - value.keys()}
    assert other == value | defaults
    plain = msgspec.json.decode(msgspec.json.encode(message))
    assert defaults == {name: plain[name] for name in defaults}
    assert not defaults or ".minimal" in path.name


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_every_type_has_a_golden_message_with_every_field(kind):
    value = written(FOLDER / "fixtures" / "v1" / f"{tag(kind)}.json")
    assert set(value) == {"type", *kind.__struct_fields__}


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_every_type_with_optional_fields_has_a_minimal_golden_message(kind):
    fields = msgspec.structs.fields(kind)
    null = [types.NoneType in getattr(field.type, "__args__", ()) for field in fields]
    path = FOLDER / "fixtures" / "v1" / f"{tag(kind)}.minimal.json"
    assert path.exists() == (any(null) or not all(field.required for field in fields))


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_only_the_decoder_of_its_key_accepts_a_message_type(kind):
    data = (FOLDER / "fixtures" / "v1" / f"{tag(kind)}.msgpack").read_bytes()
    for read in set(DECODERS.values()) - {DECODERS[tag(kind)]}:
        with pytest.raises(codec.ProtocolError) as caught:
            read(data)
        assert (caught.value.code, caught.value.where) == ("unknown_type", "type")
