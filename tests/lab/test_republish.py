"""Recordings are published in their order, describe their robot, and take no commands."""

import asyncio
from itertools import islice

import pytest
from tests.lab.golden import INFO, IO, STATE, TRUTH, changed, record

from tvist_lab import republish
from tvist_lab.recordings import RecordingError
from tvist_lab.recordings.mcap_file import read
from tvist_lab.republish import Playback, played
from tvist_protocol import Event, Info, State
from tvist_protocol.codec import decode, encode
from tvist_protocol.journal import Entry

MESSAGES = [
    changed(IO, tick=4),
    *(changed(STATE, tick=tick, timestamp=tick * 0.002) for tick in (4, 5)),
    Event(tick=6, kind="warning", why="a"),
    changed(STATE, tick=6, timestamp=0.012),
    changed(TRUTH, tick=6, timestamp=0.012),
]


class Listener:
    """Stands in for the network, and keeps what is published."""

    def __init__(self, *_, **__):
        self.told = []
        self.closed = False

    def gateway(self, robot, desk, **_):
        self.robot, self.desk = robot, desk
        return self

    def publish(self, topic, message, payload):
        assert payload == encode(message)
        self.told.append((topic, message))

    def close(self):
        self.closed = True


@pytest.fixture
def path(tmp_path):
    return record(tmp_path / "run.mcap", [*MESSAGES, Entry(tick=7, kind="missed", count=1)])


@pytest.fixture
def network(monkeypatch):
    made = Listener()
    monkeypatch.setattr(republish, "Network", lambda *_, **__: made)
    monkeypatch.setattr(republish, "LEAVE", 60.0)
    return made


def test_all_messages_are_published_in_order(path, network):
    playback = Playback(read(path), ["tcp/127.0.0.1:1"], speed=100.0)
    asyncio.run(playback.run())
    assert [message for _, message in network.told] == MESSAGES
    assert [topic for topic, _ in network.told] == ["io", "state", "state", "event", "state", "truth"]
    assert (playback.states, network.robot, network.closed) == (3, INFO.name, True)


def test_ticks_and_times_continue_in_a_loop(path):
    messages = list(islice(played(read(path), loop=True), 13))
    assert [message.tick for message in messages] == [4, 4, 5, 6, 6, 6, 7, 7, 8, 9, 9, 9, 10]
    times = [message.timestamp for message in messages if isinstance(message, State)]
    assert times == pytest.approx([0.008, 0.010, 0.012, 0.014, 0.016, 0.018])


async def test_playback_has_the_timing_of_the_recording(path, network, monkeypatch):
    waited = []

    async def sleep(seconds):
        waited.append(seconds)

    monkeypatch.setattr(asyncio, "sleep", sleep)
    monkeypatch.setattr(asyncio.get_running_loop(), "time", lambda: 7.0)
    await Playback(read(path), ["tcp/127.0.0.1:1"], speed=0.01).run()
    assert waited == pytest.approx([0.0, 0.2, 0.4])


def test_info_has_the_name_and_the_present_tick(path, network):
    playback = Playback(read(path), ["tcp/127.0.0.1:1"], name="ghost", speed=100.0)
    asyncio.run(playback.run())
    answers = []
    network.desk.info(answers.append)
    info = decode(Info, answers[0]())
    assert (info.name, info.tick, info.control, info.clock) == ("ghost", 6, None, "realtime")
    assert info.limits == INFO.limits


def test_recording_without_description_is_refused(path):
    content = read(path)
    object.__setattr__(content, "info", None)
    with pytest.raises(RecordingError, match=r"run\.mcap does not describe its robot"):
        Playback(content, ["tcp/127.0.0.1:1"])
