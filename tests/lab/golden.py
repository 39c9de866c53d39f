"""The golden messages of the protocol, and recordings that are made of them."""

import random

import msgspec
from mcap.writer import CompressionType, Writer

from tvist_protocol import Info, Io, State, Truth
from tvist_protocol.generate import FOLDER
from tvist_protocol.recorded import topics
from tvist_server.recording.writer import RecordingWriter, heading


def golden(kind):
    path = FOLDER / "fixtures" / "v1" / f"{kind.__name__.lower()}.json"
    return msgspec.json.decode(path.read_bytes(), type=kind)


INFO, STATE, TRUTH, IO = map(golden, (Info, State, Truth, Io))
START = {"seed": 3, "q": [0.1 + 0.2, -0.0, 5e-324, 1e300], "nested": {"b": 1, "a": None}}
HARD_FLOATS = [5e-324, -0.0, 0.1 + 0.2, 1e300, -1e-300, 2.0**53 + 2]


def changed(message, **fields):
    return msgspec.structs.replace(message, **fields)


def states(count):
    noise = random.Random(0)
    for tick in range(1, count + 1):
        q = [noise.gauss(0.0, 1.0) for _ in range(6)]
        yield changed(
            STATE, tick=tick, timestamp=tick * 0.002, setpoint_sequence=None, actual_q=q, target_q=q[::-1]
        )


def foreign(path, messages, encoding="json", metadata=None, name="tvist"):
    """Write messages, each with its topic, as some other program does."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        if metadata is not None:
            writer.add_metadata(name, metadata)
        topics = dict.fromkeys(topic for topic, _ in messages)
        channels = {topic: writer.register_channel(topic, encoding, 0) for topic in topics}
        for time, (topic, data) in enumerate(messages):
            writer.add_message(channels[topic], time, data, time)
        writer.finish()
    return path


def record(path, messages, *, info=INFO, start=START, finish=True, dropped=None):
    """Write messages as the server does."""
    with path.open("wb") as stream:
        writer = RecordingWriter(stream, topics(info.name), heading(info, start))
        for message in messages:
            writer.write(message)
        if finish:
            writer.finish(dropped or {})
    return path
