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

each = pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)


def written(path):
    return json.loads(path.read_bytes())


def struct_of(value):
    return msgspec.convert(value, TYPES[value["type"]])


@each
def test_our_decoder_reads_the_golden_bytes_as_the_struct_of_the_json(path):
    value = written(path)
    read = DECODERS[value["type"]](path.with_suffix(".msgpack").read_bytes())
    assert read == struct_of(value)
    assert type(read) is TYPES[value["type"]]


@each
def test_what_we_encode_another_codec_reads_as_the_json(path):
    value = written(path)
    message = struct_of(value)
    read = msgpack.unpackb(encode(message))
    defaults = {name: read[name] for name in read.keys() - value.keys()}
    assert read == value | defaults
    assert defaults == {name: plain(getattr(message, name)) for name in defaults}
    assert not defaults or ".minimal" in path.name


@each
def test_a_golden_message_survives_our_own_round_trip(path):
    message = struct_of(written(path))
    assert DECODERS[tag(type(message))](encode(message)) == message
    assert check(message) == message


def plain(value):
    return msgspec.json.decode(msgspec.json.encode(value))


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_every_type_has_a_golden_message_with_every_field(kind):
    value = written(FOLDER / "fixtures" / "v1" / f"{tag(kind)}.json")
    assert set(value) == {"type", *kind.__struct_fields__}


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_every_type_with_something_optional_has_a_golden_message_without(kind):
    optional = [
        field for field in msgspec.structs.fields(kind) if not field.required or may_be_null(field.type)
    ]
    path = FOLDER / "fixtures" / "v1" / f"{tag(kind)}.minimal.json"
    assert path.exists() == bool(optional)


def may_be_null(hint):
    return types.NoneType in getattr(hint, "__args__", ())


@pytest.mark.parametrize("kind", MESSAGES, ids=tag)
def test_every_type_is_read_by_the_decoder_of_its_key_and_by_no_other(kind):
    data = (FOLDER / "fixtures" / "v1" / f"{tag(kind)}.msgpack").read_bytes()
    for read in set(DECODERS.values()) - {DECODERS[tag(kind)]}:
        with pytest.raises(codec.ProtocolError) as caught:
            read(data)
        assert (caught.value.code, caught.value.where) == ("unknown_type", "type")
