"""Recordings: files come back as they were, damaged or strange ones are refused, and messages become columns."""

import random
import struct

import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from tests.lab.golden import HARD_FLOATS, INFO, START, STATE, TRUTH, changed, foreign, record, states

from tvist_lab.recordings import Recording, RecordingError
from tvist_lab.recordings import read as read_log
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_lab.recordings.mcap_records import DAMAGE, MAGIC, records
from tvist_lab.recordings.messages import recording_of_messages
from tvist_lab.replay import ReplayError, replay_file
from tvist_protocol import Event, Setpoint, State
from tvist_protocol.journal import Entry, entry_of, message_of
from tvist_protocol.recorded import to_json

TOPIC = "tvist/ur5e/state"


def bits(values):
    return np.asarray(values, dtype=np.float64).tobytes()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mcap"


def test_messages_and_columns_are_read_back_exactly(path):
    recorded = list(states(300))
    recorded[0] = changed(recorded[0], reference_q=HARD_FLOATS, shaper_delay=-0.0)
    truths = [changed(TRUTH, tick=s.tick, timestamp=s.timestamp) for s in recorded[10:]]
    events = [Event(tick=3, kind="motion_started", id=1), Event(tick=90, kind="motion_done", id=1)]
    setpoint = Setpoint(token="t", sequence=7, q=(0.1 + 0.2, -0.0))
    journal = [entry_of(2, setpoint), Entry(tick=5, kind="client_gone", client="x")]
    found = read(record(path, [*journal, *recorded, *truths, *events]))
    assert (found.robot, found.info) == (INFO.name, INFO)
    assert bits(found.start["q"]) == bits(START["q"])
    assert bits(found.states[0].reference_q) == bits(HARD_FLOATS)
    assert (found.states, found.truths, found.events) == (tuple(recorded), tuple(truths), tuple(events))
    assert (message_of(found.journal[0]), found.journal[1]) == (setpoint, journal[1])
    assert found.complete
    assert found.note is None
    assert found.dropped == {"state": 0, "event": 0, "truth": 0, "io": 0, "journal": 0}
    columns = found.recording
    assert bits(columns["reference_q"][0]) == bits(HARD_FLOATS)
    assert bits(columns["shaper_delay"][:1]) == bits([-0.0])
    assert np.array_equal(columns["actual_q"], [s.actual_q for s in recorded])
    assert np.array_equal(columns.time, [s.timestamp for s in recorded])
    assert np.isnan(columns["setpoint_sequence"]).all()
    assert np.isnan(columns["truth_motor_q"][:10]).all()
    assert np.array_equal(columns["truth_motor_q"][10:], [t.motor_q for t in truths])
    assert [event.tick for event in columns.events] == [3, 90]


def test_number_that_is_not_finite_is_nan(path):
    broken = changed(STATE, tick=2, actual_q=[float("nan"), float("inf"), 1.0, 2.0, 3.0, 4.0])
    found = read(record(path, [changed(STATE, tick=1), broken]))
    assert found.complete
    assert np.isnan(found.recording["actual_q"][1]).tolist() == [True, True, False, False, False, False]


def test_truncated_file_is_read_up_to_a_whole_chunk(path):
    recorded = list(states(1000))
    whole = record(path, recorded).read_bytes()
    most = 0
    for length in (*random.Random(1).sample(range(1, len(whole)), 20), len(whole) - 1, len(whole) - 9):
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


def test_damaged_file_is_read_up_to_the_damage(path):
    recorded = list(states(1000))
    whole = bytearray(record(path, recorded).read_bytes())
    for position in random.Random(2).sample(range(len(whole) // 3, len(whole) * 2 // 3), 10):
        altered = bytearray(whole)
        altered[position] ^= 0x40
        path.write_bytes(altered)
        found = read(path)
        assert found.states == tuple(recorded[: len(found.states)])
        assert found.complete == (len(found.states) == 1000) or "could be read up to" in found.note


def test_unclosed_file_and_dropped_messages_are_noted(path):
    found = read(record(path, states(500), finish=False))
    assert not found.complete
    assert (found.dropped, found.start) == (None, START)
    assert f"{path} was not closed; it could be read up to tick {found.states[-1].tick}" in found.note
    found = read(record(path, states(3), dropped={State: 4, Entry: 1}))
    assert found.complete
    assert found.dropped == {"state": 4, "event": 0, "truth": 0, "io": 0, "journal": 1}
    assert "no room for: 4 of state, 1 of journal" in found.note


def test_damaged_start_and_invalid_message_are_refused(path):
    whole = record(path, states(3)).read_bytes()
    assert whole.count(b'"seed": 3') == 1
    path.write_bytes(whole.replace(b'"seed": 3', b'"seed": 4'))
    damaged = read(path)
    assert (damaged.complete, "is damaged" in damaged.note) == (False, True)
    found = read(
        foreign(path, [(TOPIC, data) for data in (to_json(STATE), b'{"type":"state"}', to_json(STATE))])
    )
    assert (len(found.states), found.complete) == (1, False)
    assert found.info is found.start is found.dropped is None
    assert "is not a valid state" in found.note


def written(content):
    return lambda path: path.write_bytes(content)


def other(*topics, **made):
    return lambda path: foreign(path, [(topic, to_json(STATE)) for topic in topics or [TOPIC]], **made)


def begun(path):
    path.write_bytes(record(path, states(100)).read_bytes()[:200])


REFUSED = [
    (lambda _: None, "No such file"),
    (written(b""), "is empty"),
    (written(b"\x89MCA"), "no MCAP file"),
    (written(b"tick,timestamp\n1,0.002\n"), "no MCAP file"),
    (begun, r"no channel tvist/<robot>/state; it was not closed"),
    (lambda path: record(path, [Event(tick=1, kind="warning")]), "holds no state"),
    (other("/odom"), "has no channel tvist/<robot>/state"),
    (other(encoding="msgpack"), "has no channel tvist/<robot>/state"),
    (other("tvist/one/state", "tvist/two/state"), "several robots, one and two"),
    (other(metadata={"format": "2"}), "has format 2: must be 1"),
    (other(metadata={"format": "1", "info": "{}"}), "has no valid info"),
    (other(metadata={"state": "few"}, name="tvist.end"), r"has no valid tvist\.end"),
]


@pytest.mark.parametrize(("make", "says"), REFUSED)
def test_other_file_and_later_format_are_refused(path, make, says):
    make(path)
    with pytest.raises(RecordingFileError, match=says):
        read(path)


DAMAGED = {
    "a time beyond all": {"timestamp": 1e18},
    "a time that goes back": {"timestamp": 0.001},
    "a time that is none": {"timestamp": float("nan")},
    "a jump in time without ticks": {"timestamp": 9.0},
    "an angle that no joint has": {"target_q": [0.0, 1e300, 0.0, 0.0, 0.0, 0.0]},
    "a speed that no joint has": {"target_qd": [0.0, 0.0, -1e160, 0.0, 0.0, 0.0]},
    "a delay that no shaper has": {"shaper_delay": 1e300},
    "a tick far ahead": {"tick": 10**12},
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_implausible_number_is_refused_with_its_position(kind, tmp_path):
    messages = list(states(20))
    messages[11] = changed(messages[11], **DAMAGED[kind])
    path = record(tmp_path / "run.mcap", messages)
    with pytest.raises(RecordingError, match=str(path)):
        read_log(path)


@pytest.mark.parametrize(
    ("name", "width"), [("actual_q", 0), ("actual_TCP_pose", 3), ("actual_tool_accelerometer", 6)]
)
def test_vector_of_wrong_length_is_refused(name, width, tmp_path):
    path = record(tmp_path / "run.mcap", [changed(one, **{name: [0.1] * width}) for one in states(20)])
    with pytest.raises(RecordingError, match=rf"{path}: column \w+ has rows of the shape"):
        read_log(path)


def test_recording_without_most_ticks_is_not_replayed(tmp_path):
    late = changed(STATE, tick=10**7, timestamp=2e4)
    content = read(record(tmp_path / "run.mcap", [*states(20), late]))
    with pytest.raises(ReplayError, match="ends at tick 10000000: must be at most 32100 with 21 states"):
        replay_file(content)


def _part(kind, data=b""):
    return struct.pack("<BQ", kind, len(data)) + data


@pytest.mark.parametrize(("size", "count"), [(0, 10**7), (30, 10**6), (10**8, 1)])
def test_chunk_with_more_than_its_size_is_refused(size, count, tmp_path):
    data = _part(Opcode.MESSAGE, bytes(size)) * count
    packed = zstandard.compress(data)
    head = struct.pack("<QQQII", 0, 0, len(data), 0, 4) + b"zstd" + struct.pack("<Q", len(packed))
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + _part(Opcode.HEADER, bytes(8)) + _part(Opcode.CHUNK, head + packed))
    with path.open("rb") as stream, pytest.raises(DAMAGE, match="a chunk of"):
        list(records(stream))


JOINTS = (
    "reference_q", "target_q", "target_qd", "target_qdd", "target_moment", "actual_q", "actual_qd", "actual_moment"
)  # fmt: skip


def state(tick, **fields):
    made = {"setpoint_sequence": None, "estimated_f_d": [6.7], **{name: [0.1 * tick] * 2 for name in JOINTS}}
    return changed(STATE, tick=tick, timestamp=0.002 * tick, **{**made, **fields})


def truth(tick):
    return changed(TRUTH, tick=tick, timestamp=0.002 * tick, tool_acceleration=[1.0, 2.0, 9.81])


def test_every_field_of_a_state_is_a_column():
    recording = recording_of_messages([state(3), state(4)])
    assert set(recording.columns) == set(State.__struct_fields__)
    assert recording["reference_q"].shape == (2, 2)
    assert recording["timestamp"].tolist() == [0.006, 0.008]


def test_states_are_sorted_and_duplicates_dropped():
    recording = recording_of_messages([state(5), state(4), state(5), state(6)])
    assert recording["tick"].tolist() == [4, 5, 6]


def test_joints_and_period_are_right_with_missing_ticks():
    recording = recording_of_messages([state(10), state(11), state(15)])
    assert recording.joints == 2
    assert recording.period == pytest.approx(0.002)
    assert recording.missing_ticks == 3


def test_null_and_short_lists_become_nan():
    states = [state(0), state(1, setpoint_sequence=8, estimated_f_d=[6.7, 9.0]), state(2, estimated_f_d=[])]
    recording = recording_of_messages(states)
    np.testing.assert_array_equal(recording["setpoint_sequence"], [np.nan, 8.0, np.nan])
    np.testing.assert_array_equal(recording["estimated_f_d"], [[6.7, np.nan], [6.7, 9.0], [np.nan, np.nan]])
    assert recording_of_messages([state(0, estimated_f_d=[])] * 2)["estimated_f_d"].shape == (1, 0)


def test_truth_is_aligned_by_tick():
    recording = recording_of_messages([state(1), state(2)], truths=[truth(2), truth(7)])
    column = recording["truth_tool_acceleration"]
    assert np.isnan(column[0]).all()
    assert column[1].tolist() == [1.0, 2.0, 9.81]
    assert "truth_flange_pose" in recording
    assert "truth_tick" not in recording


def test_slice_includes_both_ends():
    events = [Event(tick=tick, kind="warning") for tick in (9, 2, 4, 5)]
    part = recording_of_messages([state(tick) for tick in range(10)], events, info="info").between(2, 4)
    assert part["tick"].tolist() == [2, 3, 4]
    assert [event.tick for event in part.events] == [2, 4]
    assert part.info == "info"
    with pytest.raises(RecordingError, match="no state between ticks 5 and 9"):
        part.between(5, 9)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: recording_of_messages([]), "at least one state"),
        (lambda: Recording({}), "needs the column tick"),
        (lambda: Recording({"tick": np.arange(2.0), "timestamp": np.zeros(1)}), "has 1 rows, column tick 2"),
        (lambda: Recording({"tick": np.zeros(2)}), "must increase"),
        (lambda: recording_of_messages([state(1)]).period, "two states"),
        (lambda: recording_of_messages([state(1)])["colour"], r"no column colour; it has .*reference_q"),
        (lambda: recording_of_messages([state(1)])["truth_tool_acceleration"], "was truth recorded"),
    ],
)
def test_inconsistent_and_missing_columns_are_refused(make, words):
    with pytest.raises(RecordingError, match=words):
        make()
