"""Recordings on disk come back as they were, cut ones up to the cut, and strangers are turned away."""

import io
import random

import msgspec
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from tvist_lab.recordings import RecordingError
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_protocol import Event, Info, Setpoint, State, Truth
from tvist_protocol.generate import FOLDER
from tvist_protocol.journal import Entry, entry_of, message_of
from tvist_protocol.recorded import to_json, topics
from tvist_server.recording.writer import RecordingWriter, heading

START = {"seed": 3, "q": [0.1 + 0.2, -0.0, 5e-324, 1e300]}
HARD_FLOATS = [5e-324, -0.0, 0.1 + 0.2, 1e300, -1e-300, 2.0**53 + 2]


def golden(name, kind):
    return msgspec.json.decode((FOLDER / "fixtures" / "v1" / f"{name}.json").read_bytes(), type=kind)


INFO, STATE, TRUTH = golden("info", Info), golden("state", State), golden("truth", Truth)


def bits(values):
    return np.asarray(values, dtype=np.float64).tobytes()


def states(count):
    noise = random.Random(0)
    for tick in range(1, count + 1):
        q = [noise.gauss(0.0, 1.0) for _ in range(6)]
        changes = {"timestamp": tick * 0.002, "setpoint_sequence": None, "actual_q": q, "target_q": q[::-1]}
        yield msgspec.structs.replace(STATE, tick=tick, **changes)


def record(path, messages, *, info=INFO, finish=True, dropped=None):
    with path.open("wb") as stream:
        writer = RecordingWriter(stream, topics(info.name), heading(info, START))
        for message in messages:
            writer.write(message)
        if finish:
            writer.finish(dropped or {})
    return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mcap"


def foreign(path, topic="tvist/ur5e/state", encoding="json", messages=(), metadata=None, name="tvist"):
    """A file some other program wrote."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        if metadata is not None:
            writer.add_metadata(name, metadata)
        channel = writer.register_channel(topic, encoding, 0)
        for time, data in enumerate(messages):
            writer.add_message(channel, time, data, time)
        writer.finish()
    return path


def test_messages_come_back_equal(path):
    recorded = list(states(300))
    truths = [msgspec.structs.replace(TRUTH, tick=s.tick, timestamp=s.timestamp) for s in recorded]
    events = [Event(tick=3, kind="motion_started", id=1), Event(tick=90, kind="motion_done", id=1)]
    setpoint = Setpoint(token="t", sequence=7, q=(0.1 + 0.2, -0.0))
    journal = [entry_of(2, setpoint), Entry(tick=5, kind="client_gone", client="x")]
    found = read(record(path, [*journal, *recorded, *truths, *events]))
    assert found.robot == INFO.name
    assert found.info == INFO
    assert found.states == tuple(recorded)
    assert found.truths == tuple(truths)
    assert found.events == tuple(events)
    assert [entry.tick for entry in found.journal] == [2, 5]
    assert message_of(found.journal[0]) == setpoint
    assert found.journal[1] == journal[1]
    assert found.complete
    assert found.note is None
    assert found.dropped == {"state": 0, "event": 0, "truth": 0, "io": 0, "journal": 0}


def test_every_bit_comes_back(path):
    state = msgspec.structs.replace(STATE, tick=1, reference_q=HARD_FLOATS, shaper_delay=-0.0)
    found = read(record(path, [state]))
    assert bits(found.states[0].reference_q) == bits(HARD_FLOATS)
    assert bits(found.recording["reference_q"][0]) == bits(HARD_FLOATS)
    assert bits(found.recording["shaper_delay"]) == bits([-0.0])
    assert bits(found.start["q"]) == bits(START["q"])


def test_columns_are_those_of_the_states(path):
    recorded = list(states(50))
    truths = [msgspec.structs.replace(TRUTH, tick=s.tick) for s in recorded[10:]]
    recording = read(record(path, [*recorded, *truths, Event(tick=7, kind="warning")])).recording
    assert np.array_equal(recording["actual_q"], [s.actual_q for s in recorded])
    assert np.array_equal(recording.time, [s.timestamp for s in recorded])
    assert np.all(np.diff(recording.time) > 0)
    assert np.isnan(recording["setpoint_sequence"]).all()
    assert np.isnan(recording["truth_motor_q"][:10]).all()
    assert np.array_equal(recording["truth_motor_q"][10:], [t.motor_q for t in truths])
    assert [event.tick for event in recording.events] == [7]
    assert recording.info == INFO


def test_a_number_that_was_not_finite_is_nan(path):
    broken = msgspec.structs.replace(STATE, tick=2, actual_q=[float("nan"), float("inf"), 1.0, 2.0, 3.0, 4.0])
    found = read(record(path, [msgspec.structs.replace(STATE, tick=1), broken]))
    assert found.complete
    assert np.isnan(found.recording["actual_q"][1]).tolist() == [True, True, False, False, False, False]


def test_a_file_cut_anywhere_is_read_up_to_a_whole_chunk(path):
    recorded = list(states(1000))
    whole = record(path, recorded).read_bytes()
    lengths = random.Random(1).sample(range(1, len(whole)), 40)
    most = 0
    for length in (*lengths, len(whole) - 1, len(whole) - 8, len(whole) - 9):
        path.write_bytes(whole[:length])
        try:
            found = read(path)
        except RecordingFileError as error:
            assert length < len(whole) / 2, error  # noqa: PT017  only before the first chunk is whole
            continue
        assert not found.complete
        assert "could be read up to tick" in found.note
        assert found.states == tuple(recorded[: len(found.states)])
        most = max(most, len(found.states))
    assert most == 1000


def test_a_file_altered_in_the_middle_is_read_up_to_there(path):
    recorded = list(states(1000))
    whole = bytearray(record(path, recorded).read_bytes())
    for position in random.Random(2).sample(range(len(whole) // 3, len(whole) * 2 // 3), 20):
        altered = bytearray(whole)
        altered[position] ^= 0x40
        path.write_bytes(altered)
        found = read(path)
        assert found.states == tuple(recorded[: len(found.states)])
        assert found.complete == (len(found.states) == 1000) or "could be read up to" in found.note


def test_a_file_that_was_never_closed_says_so(path):
    found = read(record(path, states(500), finish=False))
    assert not found.complete
    assert found.dropped is None
    assert str(path) in found.note
    assert f"was not closed; it could be read up to tick {found.states[-1].tick}" in found.note
    assert found.start == START


def test_what_was_dropped_is_said(path):
    found = read(record(path, states(3), dropped={State: 4, Entry: 1}))
    assert found.complete
    assert found.dropped == {"state": 4, "event": 0, "truth": 0, "io": 0, "journal": 1}
    assert "no room for: 4 of state, 1 of journal" in found.note


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "is empty"), (b"\x89MCA", "no MCAP file"), (b"tick,timestamp\n1,0.002\n", "no MCAP file")],
)
def test_what_is_no_mcap_file_is_refused(path, content, says):
    path.write_bytes(content)
    with pytest.raises(RecordingFileError, match=says):
        read(path)


def test_a_file_that_cannot_be_opened_is_refused(tmp_path):
    with pytest.raises(RecordingFileError, match="No such file"):
        read(tmp_path / "none.mcap")
    with pytest.raises(RecordingError, match="names no recording: no MCAP file is there"):
        read(tmp_path)


def test_a_recording_without_a_state_is_refused(path):
    with pytest.raises(RecordingFileError, match="holds no state"):
        read(record(path, [Event(tick=1, kind="warning")]))


def test_a_recording_cut_before_its_first_state_says_both(path):
    whole = record(path, states(100)).read_bytes()
    path.write_bytes(whole[:200])
    with pytest.raises(RecordingFileError, match=r"no channel tvist/<robot>/state; it was not closed"):
        read(path)


@pytest.mark.parametrize(
    ("made", "says"),
    [
        ({"topic": "/odom"}, "has no channel tvist/<robot>/state"),
        ({"encoding": "msgpack"}, "has no channel tvist/<robot>/state"),
        ({"metadata": {"format": "2"}}, "has format 2; 1 can be read"),
        ({"metadata": {"format": "1", "info": "{}"}}, "has no valid info"),
        ({"metadata": {"state": "few"}, "name": "tvist.end"}, r"has no valid tvist\.end"),
    ],
)
def test_a_file_of_something_else_or_of_a_later_format_is_refused(path, made, says):
    with pytest.raises(RecordingFileError, match=says):
        read(foreign(path, messages=[to_json(STATE)], **made))


def test_states_another_program_recorded_are_read(path):
    found = read(foreign(path, messages=[to_json(state) for state in states(3)]))
    assert len(found.states) == 3
    assert found.info is found.start is found.dropped is None
    assert found.complete


def test_a_start_that_was_altered_on_the_disk_is_noticed(path):
    whole = record(path, states(3)).read_bytes()
    assert whole.count(b'"seed": 3') == 1
    path.write_bytes(whole.replace(b'"seed": 3', b'"seed": 4'))
    found = read(path)
    assert not found.complete
    assert "is damaged" in found.note


def test_a_message_that_is_none_ends_what_can_be_read(path):
    found = read(foreign(path, messages=[to_json(STATE), b'{"type":"state"}', to_json(STATE)]))
    assert len(found.states) == 1
    assert not found.complete
    assert "is not a valid state" in found.note


def test_two_robots_in_one_file_are_refused(path):
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    for robot in ("one", "two"):
        channel = writer.register_channel(f"tvist/{robot}/state", "json", 0)
        writer.add_message(channel, 0, to_json(STATE), 0)
    writer.finish()
    path.write_bytes(stream.getvalue())
    with pytest.raises(RecordingFileError, match="several robots, one and two"):
        read(path)


def test_an_error_of_the_file_is_an_error_of_the_recording():
    assert issubclass(RecordingFileError, RecordingError)
