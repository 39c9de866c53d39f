"""The recording file: opened by the plain MCAP reader, and valid by its own schemas."""

import io
import json

import jsonschema
import msgspec
import pytest
from mcap.reader import make_reader
from tests.lab.golden import INFO, START, STATE, TRUTH, record

from tvist_protocol import Event, Info, MoveJ, Setpoint
from tvist_protocol.journal import Entry, entry_of
from tvist_server.recording.writer import heading

KINDS = ("state", "event", "truth", "io", "journal")


def session(ticks):
    """Yield messages of all kinds in a server's order."""
    for tick in range(1, ticks + 1):
        if tick == 1:
            yield entry_of(tick, MoveJ(token="t", q=(0.5, 1.0)), client="a")
        if tick % 7 == 0:
            yield entry_of(tick, Setpoint(token="t", sequence=tick, q=(0.1 * tick, -0.0)))
        if tick % 50 == 0:
            yield Entry(tick=tick, kind="missed", count=1)
            yield Event(tick=tick, kind="warning", why="late")
        q = [tick * 0.1, tick / 3, -tick / 7]
        now = {"tick": tick, "timestamp": tick * 0.002}
        sequence = tick if tick > 6 else None
        yield msgspec.structs.replace(STATE, **now, setpoint_sequence=sequence, actual_q=q)
        yield msgspec.structs.replace(TRUTH, **now, motor_q=q)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return record(tmp_path_factory.mktemp("recording") / "run.mcap", session(400)).read_bytes()


def test_the_plain_mcap_reader_opens_a_recording(recording):
    reader = make_reader(io.BytesIO(recording), validate_crcs=True)
    summary = reader.get_summary()
    encodings = {channel.topic: channel.message_encoding for channel in summary.channels.values()}
    assert encodings == dict.fromkeys((f"tvist/ur5e/{kind}" for kind in KINDS), "json")
    schemas = {schema.name: schema.encoding for schema in summary.schemas.values()}
    assert schemas == dict.fromkeys((f"tvist.{kind}" for kind in KINDS), "jsonschema")
    assert len(summary.chunk_indexes) > 3
    assert {index.compression for index in summary.chunk_indexes} == {"zstd"}


def test_messages_match_their_schemas_and_times_ascend(recording):
    validators, times = {}, []
    for schema, _, message in make_reader(io.BytesIO(recording)).iter_messages(log_time_order=False):
        if schema.id not in validators:
            content = json.loads(schema.data)
            jsonschema.Draft202012Validator.check_schema(content)
            validators[schema.id] = jsonschema.Draft202012Validator(content)
        said = json.loads(message.data)
        validators[schema.id].validate(said)
        assert message.log_time == message.publish_time == said["tick"] * 2_000_000
        times.append(message.log_time)
    assert len(validators) == 4
    assert times == sorted(times)


def test_metadata_has_the_start_options_and_dropped_messages(recording):
    metadata = {m.name: m.metadata for m in make_reader(io.BytesIO(recording)).iter_metadata()}
    assert metadata["tvist"]["format"] == "1"
    assert json.loads(metadata["tvist"]["start"]) == START
    assert msgspec.json.decode(metadata["tvist"]["info"], type=Info) == INFO
    assert metadata["tvist.end"] == dict.fromkeys(KINDS, "0")


def test_start_options_that_json_cannot_represent_are_refused():
    for wrong in (float("nan"), object(), float("inf")):
        with pytest.raises((TypeError, ValueError)):
            heading(INFO, {"x": wrong})
