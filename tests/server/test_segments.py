"""Recordings in segments keep enough of the last ticks, in complete files."""

import errno
import os

import msgspec
import pytest
from tests.lab.golden import INFO, IO, STATE, TRUTH

from tvist_lab.recordings import RecordingError
from tvist_lab.recordings import read as read_log
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_protocol import Event, State
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import segment_name, segment_of, topics
from tvist_server.recording import RecorderError, writer
from tvist_server.recording.recorder import Recorder
from tvist_server.recording.segments import Segments
from tvist_server.recording.writer import heading

KEEP = 100


def messages(ticks):
    """Yield a robot's messages: io once, and an event every seventh tick."""
    for tick in range(1, ticks + 1):
        yield Entry(tick=tick, kind="missed", count=1)
        if tick == 1:
            yield msgspec.structs.replace(IO, tick=tick, actual_digital_output_bits=5)
        if tick % 7 == 0:
            yield Event(tick=tick, kind="warning", why=str(tick))
        yield msgspec.structs.replace(STATE, tick=tick, timestamp=tick * 0.002)
        yield msgspec.structs.replace(TRUTH, tick=tick, timestamp=tick * 0.002)


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "CHUNK_SIZE", 8 * 1024)  # some five ticks
    return tmp_path / "run.mcap"


def names(folder):
    return sorted(place.name for place in folder.iterdir())


def run_names(path, run, numbers):
    return [segment_name(path.name, run, number) for number in numbers]


def record(path, ticks, killed=False, kinds=State):
    """Record ticks' messages of some kinds; killed, the files are left as they are."""
    recorder = Recorder(path, INFO, {"seed": 1}, keep=KEEP, wait=True)
    for message in messages(ticks):
        if isinstance(message, kinds):
            recorder.take(message)
    if killed:
        while recorder._queue:
            recorder._wake.set()
        recorder._file.write = recorder._file.finish = lambda *_: None
    recorder.close()
    assert recorder.error is None
    return recorder


@pytest.mark.parametrize("ticks", [10, KEEP, KEEP + 1, 277])
def test_a_recording_keeps_the_last_ticks_in_four_segments(ticks, path):
    recorder = record(path, ticks, kinds=object)
    last = (ticks - 1) // 25 + 1
    assert names(path.parent) == run_names(path, 1, range(max(last - 4, 1), last + 1))
    assert recorder.place == path.with_name("run-1-part*.mcap")
    for named in (recorder.place, path.parent, path) if ticks == KEEP + 1 else (path,):
        content = read(named)
        assert content.complete
        assert content.dropped == {"state": 0, "event": 0, "truth": 0, "io": 0, "journal": 0}
        kept_ticks = list(range(content.states[0].tick, ticks + 1))
        assert min(ticks, KEEP) <= len(kept_ticks) <= 1.25 * KEEP
        for kind in (content.states, content.truths, content.journal):
            assert [message.tick for message in kind] == kept_ticks
        assert [event.tick for event in content.events] == [tick for tick in kept_ticks if tick % 7 == 0]
        assert content.recording["actual_digital_output_bits"].tolist() == [5.0] * len(kept_ticks)
        assert content.from_tick == (None if kept_ticks[0] == 1 else kept_ticks[0])
        assert len(read_log(named)) == len(content.states)


def test_dropped_messages_are_counted_for_each_segment_and_in_total(path):
    dropped = dict.fromkeys(topics(INFO.name), 0)
    written = Segments(path, topics(INFO.name), heading(INFO, {}), dropped, KEEP)
    for message in messages(60):
        if isinstance(message, State):
            dropped[State] += message.tick in (3, 30, 31)
            written.write(message)
    written.finish()
    written.close()
    assert [read(path.with_name(name)).dropped["state"] for name in names(path.parent)] == [1, 2, 0]
    assert read(path).dropped["state"] == 3


def test_segments_of_several_recordings_are_not_joined(path):
    record(path, 30)
    record(path, 30)
    for named, reader in ((path.parent, read), (path.with_name("*.mcap"), read_log)):
        with pytest.raises(RecordingError, match=r"names 2 recordings, run-1-part\*\.mcap, run-2-part"):
            reader(named)
    with pytest.raises(RecordingError, match=r"x-\*\.mcap names no recording"):
        read(path.with_name("x-*.mcap"))


def test_a_recording_without_a_middle_segment_is_refused(path):
    record(path, 100)
    (path.parent / names(path.parent)[1]).unlink()
    with pytest.raises(RecordingError, match="lacks segment"):
        read(path)


def ticks_of(path):
    return [state.tick for state in read(path).states]


def kept(path, number):
    return path.with_name(segment_name(path.name, number, None))


@pytest.mark.parametrize(
    ("name", "killed"),
    [
        ("run.mcap", True),
        ("run", False),
        ("run[1].mcap", False),
        ("run*.mcap", True),
        ("a.2026-11-29", False),
    ],
)
def test_an_earlier_recording_stays_and_the_name_means_the_latest(name, killed, path):
    path = path.with_name(name)
    record(path, 130, killed)
    content = read(path)
    before = [state.tick for state in content.states]
    assert before[-1] > 120
    assert before == list(range(before[0], before[-1] + 1))
    assert len(before) >= KEEP - 10
    assert content.complete is not killed
    record(path, 20)
    assert ticks_of(kept(path, 1)) == before
    assert ticks_of(path) == ticks_of(kept(path, 2)) == list(range(1, 21))


def test_the_five_newest_runs_and_other_files_are_kept(path):
    names_of_others = ("run.1.mcap", "run-1.mcap", "run-x-part0001.mcap", "run-01-part0001.mcap")
    strange = [path.with_name(name) for name in names_of_others]
    for place in strange:
        place.write_bytes(b"mine")
    for number in range(1, 9):
        record(path, 30 + number, killed=number % 2 == 0)
    assert all(ticks_of(kept(path, number))[-1] > 20 for number in range(3, 9))
    left = {*names(path.parent)} - {place.name for place in strange}
    assert {segment_of(name)[1] for name in left} == set(range(3, 9))
    assert all(place.read_bytes() == b"mine" for place in strange)


@pytest.mark.parametrize(
    ("content", "stays"),
    [(b"", False), (b"\x89MCAP0\r\n", False), (bytes(5000), True)],
    ids=["empty", "begun", "zeros"],
)
def test_a_damaged_segment_does_not_block_the_next_recording(content, stays, path):
    left = path.with_name(segment_name(path.name, 1, 1))
    left.write_bytes(content)
    record(path, 20)
    assert names(path.parent) == run_names(path, 1, [1]) + (run_names(path, 2, [1]) if stays else [])
    assert not stays or left.read_bytes() == content
    assert ticks_of(path) == list(range(1, 21))


@pytest.mark.parametrize("keep", [KEEP, None])
def test_a_full_disk_deletes_no_earlier_recording(keep, path, monkeypatch):
    record(path, 20)

    class Full(writer.Writer):
        def add_metadata(self, *_):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(writer, "Writer", Full)
        for _ in range(9):
            with pytest.raises(RecorderError, match="No space left on device"):
                Recorder(path if keep else path.with_name("all.mcap"), INFO, {}, keep=keep)
    assert names(path.parent) == run_names(path, 1, [1])
    assert ticks_of(path) == list(range(1, 21))


def test_a_file_without_segments_is_kept_and_read_by_its_name(path, caplog):
    with Recorder(path, INFO, {}) as recorder:
        recorder.state(STATE)
    record(path, 20)
    assert f"{path} is an earlier recording and stays: this one is {kept(path, 1)}" in caplog.text
    assert ticks_of(path) == [STATE.tick]
    assert ticks_of(kept(path, 1)) == list(range(1, 21))


def test_segments_in_use_by_another_process_are_never_deleted(path):
    with Recorder(path, INFO, {}, keep=KEEP, wait=True) as first:
        for _ in range(7):
            record(path, 10)
    assert first.error is None
    assert kept(path, 1) == first.place
    assert path.with_name(segment_name(path.name, 1, 1)).exists()


def test_a_moved_segment_is_completed_where_it_is(path):
    said = []
    recorder = Recorder(path, INFO, {}, keep=KEEP, wait=True, on_moved=said.append)
    moved = path.with_name(segment_name(path.name, 1, 1)).rename(path.with_name("elsewhere.mcap"))
    for message in messages(30):
        if isinstance(message, State):
            recorder.state(message)
    recorder.close()
    assert recorder.error is None
    assert ticks_of(moved) == list(range(1, 26))
    assert ticks_of(path) == list(range(26, 31))


def test_a_replay_without_the_first_ticks_is_refused(path):
    record(path, 350)
    with pytest.raises(ReplayError, match="starts at tick 226, and only one from tick 0 can be replayed"):
        replay_file(read(path))


@pytest.mark.parametrize(
    ("name", "segment"),
    [("run", "run-2-part0003"), (".mcap", ".mcap-2-part0003"), ("a.b.c", "a.b-2-part0003.c")],
)
def test_a_segments_name_has_recording_run_and_number(name, segment):
    assert segment_name(name, 2, 3) == segment
    assert segment_of(segment) == (name, 2, 3)
    assert segment_of(name) is None
