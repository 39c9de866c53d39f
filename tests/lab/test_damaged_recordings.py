"""Recordings of this controller that were damaged or made to do harm are refused as logs of other controllers are."""

import struct

import msgspec
import pytest
import zstandard
from mcap.opcode import Opcode
from tests.lab.test_mcap_file import STATE, record, states

from tvist_lab.recordings import RecordingError, read
from tvist_lab.recordings.mcap_file import read as read_file
from tvist_lab.recordings.mcap_records import DAMAGE, MAGIC, records
from tvist_lab.replay import ReplayError, replay_file

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
def test_a_number_that_no_robot_has_is_refused_where_it_stands(kind, tmp_path):
    messages = list(states(20))
    messages[11] = msgspec.structs.replace(messages[11], **DAMAGED[kind])
    path = record(tmp_path / "run.mcap", messages)
    with pytest.raises(RecordingError, match=str(path)):
        read(path)


@pytest.mark.parametrize("width", [0, 3])
@pytest.mark.parametrize("name", ["actual_TCP_pose", "actual_q", "actual_tool_accelerometer"])
def test_a_vector_of_another_width_than_it_needs_is_refused(name, width, tmp_path):
    values = [0.1] * (width if name != "actual_tool_accelerometer" else 2 * width)
    path = record(
        tmp_path / "run.mcap", [msgspec.structs.replace(one, **{name: values}) for one in states(20)]
    )
    with pytest.raises(RecordingError, match=rf"{path}: column \w+ has rows of the shape"):
        read(path)


def test_a_recording_that_lacks_nearly_all_ticks_is_not_replayed(tmp_path):
    late = msgspec.structs.replace(STATE, tick=10**7, timestamp=2e4)
    content = read_file(record(tmp_path / "run.mcap", [*states(20), late]))
    with pytest.raises(ReplayError, match="to tick 10000000, but of 21 states at most 32100"):
        replay_file(content)


def _part(kind, data=b""):
    return struct.pack("<BQ", kind, len(data)) + data


@pytest.mark.parametrize(("size", "count"), [(0, 10**7), (30, 10**6), (10**8, 1)])
def test_a_chunk_holds_no_more_than_its_size_allows(size, count, tmp_path):
    data = _part(Opcode.MESSAGE, bytes(size)) * count
    packed = zstandard.compress(data)
    head = struct.pack("<QQQII", 0, 0, len(data), 0, 4) + b"zstd" + struct.pack("<Q", len(packed))
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + _part(Opcode.HEADER, bytes(8)) + _part(Opcode.CHUNK, head + packed))
    with path.open("rb") as stream, pytest.raises(DAMAGE, match="a chunk of"):
        list(records(stream))
