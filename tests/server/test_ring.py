"""Recordings that keep the last ticks: enough of them, in two files at most, and readable at any time."""

import errno
import os
import shutil
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest
from mcap.reader import make_reader

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_protocol import Event, Info, Io, State, Truth
from tvist_protocol.generate import FOLDER
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import earlier_name, topics
from tvist_server.recording import Recorder, RecorderError, writer
from tvist_server.recording.joined import complete
from tvist_server.recording.ring import Ring
from tvist_server.recording.writer import heading

KEEP = 100


def golden(kind):
    path = FOLDER / "fixtures" / "v1" / f"{kind.__name__.lower()}.json"
    return msgspec.json.decode(path.read_bytes(), type=kind)


INFO, STATE, TRUTH, IO = map(golden, (Info, State, Truth, Io))


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


def test_existing_files_are_not_replaced(path):
    path.with_name(earlier_name(path.name)).write_bytes(b"mine")
    with pytest.raises(RecorderError, match=r"run\.earlier\.mcap exists already"):
        Recorder(path, INFO, {}, keep=KEEP)
    assert names(path.parent) == [earlier_name(path.name)]


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
    ("name", "earlier"),
    [
        ("run.mcap", "run.earlier.mcap"),
        ("run", "run.earlier"),
        (".mcap", ".mcap.earlier"),
        ("a.b.c", "a.b.earlier.c"),
    ],
)
def test_the_name_of_the_older_file(name, earlier):
    assert earlier_name(name) == earlier
