"""Recordings that keep the last ticks: enough of them, in two files at most, and readable at any time."""

import errno
import os
import re
import shutil
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest
from mcap.reader import make_reader
from tests.server.test_recording_writer import INFO, STATE, TRUTH, golden

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_protocol import Event, Io, State, Truth
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import earlier_name, topics
from tvist_server.recording import RecorderError, writer
from tvist_server.recording.joined import complete
from tvist_server.recording.recorder import Recorder
from tvist_server.recording.ring import Ring
from tvist_server.recording.writer import heading

KEEP = 100


IO = golden("io", Io)


def messages(ticks, first=1):
    """What a robot sends: inputs and outputs once, and an event now and then."""
    for tick in range(first, first + ticks):
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


def ring(path, overwrite=False):
    return Ring(path, topics(INFO.name), heading(INFO, {"seed": 1}), overwrite=overwrite, keep=KEEP)


def assert_whole(content, last, at_least=KEEP):
    """Nothing is missing or twice from the first state to the last."""
    ticks = [state.tick for state in content.states]
    assert all(after - before == 1 for before, after in pairwise(ticks))
    assert ticks[-1] == last
    assert at_least <= len(ticks) <= 2 * KEEP
    assert [truth.tick for truth in content.truths] == ticks
    assert [entry.tick for entry in content.journal] == ticks
    assert [event.tick for event in content.events] == [tick for tick in ticks if tick % 7 == 0]
    assert content.recording["actual_digital_output_bits"].tolist() == [5.0] * len(ticks)
    assert content.from_tick == (None if ticks[0] == 1 else ticks[0])


@pytest.mark.parametrize("ticks", [40, KEEP, KEEP + 1, 2 * KEEP, 2 * KEEP + 1, 777])
def test_at_the_end_there_is_one_file_with_the_last_ticks_and_an_index(ticks, path):
    with Recorder(path, INFO, {"seed": 1}, keep=KEEP, wait=True) as recorder:
        for message in messages(ticks):
            match message:
                case State():
                    recorder.state(message)
                case Truth():
                    recorder.truth(message)
                case Event():
                    recorder.event(message)
                case Io():
                    recorder.io(message)
                case Entry():
                    recorder.journal(message)
    assert recorder.error is None
    assert recorder.place == path
    assert names(path.parent) == [path.name]
    content = read(path)
    assert content.complete
    assert content.dropped == {"state": 0, "event": 0, "truth": 0, "io": 0, "journal": 0}
    assert_whole(content, ticks, at_least=min(ticks, KEEP))
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        statistics = reader.get_summary().statistics
        by_index = list(reader.iter_messages(log_time_order=True))
        assert [metadata.name for metadata in reader.iter_metadata()][-1] == "tvist.end"
    assert len(by_index) == statistics.message_count
    assert statistics.message_count == len(content.events) + len(content.io) + 3 * len(content.states)
    late = [
        message for _, _, message in by_index if message.log_time >= statistics.message_end_time - 20_000_000
    ]
    with path.open("rb") as stream:
        found = list(make_reader(stream).iter_messages(starting_at=statistics.message_end_time - 20_000_000))
    assert [message.data for _, _, message in found] == [message.data for message in late]


def test_it_can_be_read_after_any_message_as_if_the_process_had_been_killed(path):
    written = ring(path)
    for number, message in enumerate(messages(450)):
        written.write(message)
        if number % 37 == 0 and number > 60:
            written.flush()
            content = read(path)
            assert not content.complete
            last = content.states[-1].tick
            assert message.tick - 10 <= last <= message.tick
            ticks = [state.tick for state in content.states]
            assert ticks == list(range(ticks[0], last + 1))
            assert len(ticks) >= min(KEEP, message.tick) - 10
            assert [event.tick for event in content.events][:3] == [
                t for t in range(ticks[0], last) if t % 7 == 0
            ][:3]
    assert names(path.parent) == [earlier_name(path.name), path.name]
    written.close()


@pytest.mark.parametrize("step", range(4))
def test_a_kill_while_the_files_change_places_loses_nothing(step, path, monkeypatch):
    class Killed(BaseException):
        pass

    left = [step]

    def counted(function):
        def run(*arguments):
            if left[0] == 0:
                raise Killed
            left[0] -= 1
            return function(*arguments)

        return run

    written = ring(path)
    with monkeypatch.context() as patched:
        patched.setattr(os, "link", counted(os.link))
        patched.setattr(Path, "replace", counted(Path.replace))
        try:
            for message in messages(KEEP + 1):
                written.write(message)
        except Killed:
            assert step < 3
    written.close()
    assert [state.tick for state in read(path).states] == list(range(1, KEEP + 1))


def test_a_kill_while_the_files_are_joined_loses_nothing(path, tmp_path):
    written = ring(path)
    for message in messages(330):
        written.write(message)
    written._writer.end_part()
    earlier = path.with_name(earlier_name(path.name))
    parts = tmp_path / "parts"
    parts.mkdir()
    length = earlier.stat().st_size
    for place in (path, earlier):
        shutil.copy(place, parts)
    before = read(parts / path.name)
    complete(earlier, path, {})
    joined = earlier.read_bytes()
    written.close()
    for cut in (
        length - 30,
        length,
        length + 5000,
        (length + len(joined)) // 2,
        len(joined) - 9,
        len(joined),
    ):
        (parts / earlier.name).write_bytes(joined[:cut])
        content = read(parts / path.name)
        assert content.states == before.states
        assert content.truths == before.truths
        assert content.events == before.events
        assert content.journal == before.journal


def test_a_disk_that_is_full_at_the_end_leaves_both_files_readable(path, monkeypatch):
    recorder = Recorder(path, INFO, {}, keep=KEEP, wait=True)
    for message in messages(250):
        if isinstance(message, State):
            recorder.state(message)

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("tvist_server.recording.ring.complete", full)
    recorder.close()
    assert "No space left on device" in recorder.error
    assert [state.tick for state in read(path).states] == list(range(101, 251))


def record(path, ticks, killed=False):
    """Record ticks; killed, the files are left as they are."""
    recorder = Recorder(path, INFO, {}, keep=KEEP, wait=True)
    for message in messages(ticks):
        if isinstance(message, State):
            recorder.state(message)
    if not killed:
        recorder.close()
        return
    while recorder._queue:
        recorder._wake.set()
    recorder._file.write = recorder._file.finish = lambda *_: None
    recorder.close()


def ticks_of(path):
    return [state.tick for state in read(path).states]


def kept(path, number):
    return path.with_name(earlier_name(path.name, number))


@pytest.mark.parametrize("killed", [False, True])
@pytest.mark.parametrize("name", ["run.mcap", "run", "a.b.mcap"])
def test_a_recording_of_an_earlier_run_is_kept_under_a_number_and_both_are_readable(name, killed, path):
    path = path.with_name(name)
    record(path, 330, killed)
    before = ticks_of(path)
    assert len(before) > KEEP
    record(path, 120)
    assert ticks_of(kept(path, 1)) == before
    assert ticks_of(path) == list(range(1, 121))


def test_the_five_newest_are_kept_and_files_of_other_names_stay(path):
    strange = [
        path.with_name(name) for name in ("run.1.mcap", "run.earlier-x.mcap", "run.earlier-01.mcap", "x.mcap")
    ]
    for place in strange:
        place.write_bytes(b"mine")
    for number in range(1, 9):
        record(path, 250 + number, killed=number % 2 == 0)
    assert all(ticks_of(kept(path, number))[-1] > 230 for number in range(3, 8))
    left = {*names(path.parent)} - {place.name for place in strange}
    runs = {path.name, *(kept(path, number).name for number in range(3, 8))}
    assert runs <= left <= runs | {earlier_name(name) for name in runs}
    assert all(place.read_bytes() == b"mine" for place in strange)


def test_a_start_that_fails_costs_no_earlier_recording(path):
    record(path, 120)
    for _ in range(9):
        recorder = Recorder(path, INFO, {}, keep=KEEP)
        recorder.close()
        path.unlink()  # as a server does that cannot listen
    assert ticks_of(kept(path, 1)) == list(range(1, 121))
    assert names(path.parent) == [kept(path, 1).name]


@pytest.mark.parametrize("step", [0, 1])
def test_a_kill_while_a_recording_gets_its_number_loses_nothing(step, path, monkeypatch):
    class Killed(BaseException):
        pass

    record(path, 330, killed=True)
    before, replace, left = ticks_of(path), Path.replace, [step]

    def counted(*arguments):
        if left[0] == 0:
            raise Killed
        left[0] -= 1
        return replace(*arguments)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", counted)
        with pytest.raises(Killed):
            Recorder(path, INFO, {}, keep=KEEP)
    record(path, 20)
    assert ticks_of(kept(path, 1)) == before
    assert ticks_of(path) == list(range(1, 21))


@pytest.mark.parametrize(
    ("content", "stays"),
    [(b"", False), (b"\x89MCAP0\r\n", False), (b"\x89MC", True), (bytes(5000), True)],
    ids=["empty", "begun", "torn", "zeros"],
)
def test_what_a_power_failure_left_keeps_no_recording_from_starting(content, stays, path):
    path.write_bytes(content)
    record(path, 20)
    assert names(path.parent) == ([kept(path, 1).name] if stays else []) + [path.name]
    assert not stays or kept(path, 1).read_bytes() == content
    assert ticks_of(path) == list(range(1, 21))


@pytest.mark.parametrize("killed", [False, True])
def test_runs_that_end_before_they_have_recorded_anything_cost_no_earlier_recording(killed, path):
    """As when the system kills a process whenever it has started."""
    record(path, 120)
    for _ in range(9):
        record(path, 0, killed)
    record(path, 20)
    assert ticks_of(kept(path, 1)) == list(range(1, 121))
    assert names(path.parent) == [kept(path, 1).name, path.name]


@pytest.mark.parametrize("keep", [KEEP, None])
def test_a_full_disk_costs_no_earlier_recording_however_often_the_server_starts(keep, path, monkeypatch):
    record(path, 120)

    class Full(writer.Writer):
        def add_metadata(self, *_):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(writer, "Writer", Full)
        for _ in range(9):
            with pytest.raises(RecorderError, match="No space left on device"):
                Recorder(path if keep else path.with_name("all.mcap"), INFO, {}, keep=keep)
    if keep:
        assert names(path.parent) == [kept(path, 1).name]
        assert ticks_of(kept(path, 1)) == list(range(1, 121))
    else:
        assert names(path.parent) == [path.name]


@pytest.mark.parametrize("name", ["run.mcap", "run.earlier.mcap"])
def test_a_file_that_is_no_recording_is_left_where_it_is(name, path):
    path.with_name(name).write_bytes(b"mine")
    with pytest.raises(
        RecorderError, match=rf"{re.escape(name)} is no recording, and is not replaced: choose"
    ):
        Recorder(path, INFO, {}, keep=KEEP)
    assert names(path.parent) == [name]


def test_a_recording_that_somebody_writes_is_left_to_him(path):
    with Recorder(path, INFO, {}, keep=KEEP) as first:
        first.state(STATE)
        with pytest.raises(RecorderError, match=r"run\.mcap is being written by another process: choose"):
            Recorder(path, INFO, {}, keep=KEEP)
    assert first.error is None
    assert ticks_of(path) == [STATE.tick]


def test_a_file_that_was_moved_ends_the_recording(path):
    recorder = Recorder(path, INFO, {}, keep=KEEP)
    path.rename(path.with_name("elsewhere.mcap"))
    recorder.close()
    assert "was moved" in recorder.error


def test_replay_says_that_the_beginning_is_forgotten(path):
    with Recorder(path, INFO, {"seed": 1}, keep=KEEP, wait=True) as recorder:
        for message in messages(350):
            if isinstance(message, State):
                recorder.state(message)
    with pytest.raises(ReplayError, match="has forgotten all before tick 201, so its run cannot be repeated"):
        replay_file(read(path))


@pytest.mark.parametrize(
    ("name", "earlier", "third"),
    [
        ("run.mcap", "run.earlier.mcap", "run.earlier-3.mcap"),
        ("run", "run.earlier", "run.earlier-3"),
        (".mcap", ".mcap.earlier", ".mcap.earlier-3"),
        ("a.b.c", "a.b.earlier.c", "a.b.earlier-3.c"),
    ],
)
def test_the_names_of_the_older_part_and_of_an_earlier_run(name, earlier, third):
    assert (earlier_name(name), earlier_name(name, 3)) == (earlier, third)
