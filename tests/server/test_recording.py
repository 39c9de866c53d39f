"""The recorder takes messages without blocking, and counts what it drops."""

import queue
import threading

import msgspec
import pytest
from tests.lab.golden import INFO, STATE, TRUTH

from tvist_lab.recordings.mcap_file import read
from tvist_protocol import Event, Setpoint
from tvist_protocol.journal import Entry, entry_of
from tvist_server.recording import RecorderError
from tvist_server.recording import recorder as recorder_module
from tvist_server.recording.recorder import Recorder
from tvist_server.recording.writer import RecordingWriter


def state(tick):
    return msgspec.structs.replace(STATE, tick=tick, timestamp=tick * 0.002, actual_q=[tick / 3] * 6)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mcap"


def test_recorded_messages_are_read_back_in_order(path):
    setpoints = [Setpoint(token="t", sequence=tick, q=(0.1 + 0.2, -0.0)) for tick in range(1, 9)]
    events = [Event(tick=4, kind="motion_done", id=1), Event(tick=4, kind="warning", why="x")]
    with Recorder(path, INFO, {}) as recorder:
        for tick, setpoint in enumerate(setpoints, start=1):
            recorder.journal(entry_of(tick, setpoint))
            recorder.state(state(tick))
            recorder.truth(msgspec.structs.replace(TRUTH, tick=tick))
        for event in events:
            recorder.event(event)
    before = path.read_bytes()
    recorder.close()
    assert path.read_bytes() == before
    assert recorder.error is None
    assert recorder.dropped == 0
    found = read(path)
    assert list(found.states) == [state(tick) for tick in range(1, 9)]
    assert [truth.tick for truth in found.truths] == list(range(1, 9))
    assert list(found.events) == events
    assert [entry.tick for entry in found.journal] == list(range(1, 9))


def test_equal_runs_make_equal_files(tmp_path, monkeypatch):
    paths = tmp_path / "a.mcap", tmp_path / "b.mcap"
    for path, queue_size in zip(paths, (3, 8192), strict=True):
        monkeypatch.setattr(recorder_module, "QUEUE_SIZE", queue_size)
        with Recorder(path, INFO, {"seed": 1}, wait=True) as recorder:
            for tick in range(2000):
                recorder.state(state(tick))
        assert recorder.dropped == 0
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_messages_beyond_the_queue_are_dropped_and_counted(path, monkeypatch):
    opened, reached, write = threading.Event(), threading.Event(), RecordingWriter.write

    def held(self, message):
        reached.set()
        opened.wait(60)
        write(self, message)

    monkeypatch.setattr(RecordingWriter, "write", held)
    monkeypatch.setattr(recorder_module, "QUEUE_SIZE", 5)
    recorder = Recorder(path, INFO, {})
    recorder.state(state(0))
    assert reached.wait(60)
    for tick in range(1, 11):
        recorder.state(state(tick))
    recorder.event(Event(tick=10, kind="warning"))
    recorder.journal(Entry(tick=10, kind="missed", count=1))
    assert recorder.dropped == 7
    opened.set()
    recorder.close()
    assert recorder.error is None
    assert [s.tick for s in read(path).states] == [0, 1, 2, 3, 4, 5]
    assert read(path).dropped == {"state": 5, "event": 1, "truth": 0, "io": 0, "journal": 1}


@pytest.mark.parametrize(
    ("where", "why"),
    [("missing/run.mcap", "No such file"), (".", "exists already"), ("run.mcap", r"run\.mcap exists")],
)
def test_an_unwritable_path_or_existing_file_is_refused_before_a_thread_starts(path, where, why):
    path.write_bytes(b"precious")
    before = set(threading.enumerate())
    with pytest.raises(RecorderError, match=why):
        Recorder(path.parent / where, INFO, {})
    assert set(threading.enumerate()) <= before
    assert path.read_bytes() == b"precious"


def test_a_deleted_recording_stops_and_is_reported(path, monkeypatch):
    monkeypatch.setattr(recorder_module, "CHECK_EVERY", 0.0)
    told = queue.SimpleQueue()
    recorder = Recorder(path, INFO, {}, on_error=told.put)
    path.unlink()
    where = f"the recording {path} was deleted, or moved to another file system, where it ends"
    assert told.get(timeout=60) == f"{where}: no more is recorded"
    recorder.state(state(1))
    assert recorder.dropped == 1
    recorder.close()
    assert recorder.error is not None
    assert told.empty()


@pytest.mark.parametrize("folder", [False, True])
def test_a_moved_recording_continues_and_is_reported_once(tmp_path, monkeypatch, folder):
    monkeypatch.setattr(recorder_module, "CHECK_EVERY", 0.0)
    told, path = queue.SimpleQueue(), tmp_path / "folder" / "run.mcap"
    path.parent.mkdir()
    recorder = Recorder(path, INFO, {}, on_moved=told.put)
    if folder:
        path.parent.rename(tmp_path / "other")
        new = tmp_path / "other" / "run.mcap"
    else:
        new = path.rename(tmp_path / "new.mcap")
        path.write_bytes(b"somebody else's")
    assert told.get(timeout=60) == f"the recording {path} was moved away: it continues in {new}"
    recorder.state(state(1))
    recorder.close()
    assert recorder.error is None
    assert recorder.place == new
    assert told.empty()
    assert [one.tick for one in read(new).states] == [1]


def test_on_error_may_close_the_recorder(path):
    told = threading.Event()

    def on_error(_):
        recorder.close()
        told.set()

    recorder = Recorder(path, INFO, {}, on_error=on_error)
    recorder.state(msgspec.structs.replace(STATE, tick=-1))
    assert told.wait(60)
    recorder.close()
    assert recorder.error is not None
