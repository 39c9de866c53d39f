"""A recording with what viewers need to draw its arm: the same messages, three channels more, and a layout beside it.

The server records none of this: all of it follows from its messages, so no tick pays for it, and recordings stay small.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from heapq import merge
from pathlib import Path
from typing import IO, Any

from mcap.records import Channel, Message, Metadata, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import LIBRARY_IDENTIFIER, Writer

from tvist_lab.foxglove import layout as of_layout
from tvist_lab.foxglove.arm import arm_of
from tvist_lab.foxglove.messages import CURVES, Stamped, angles, curves, scene, schema_of, transforms
from tvist_lab.recordings.export import ExportError
from tvist_lab.recordings.mcap_file import RecordingFile
from tvist_lab.recordings.mcap_records import DAMAGE, opened, ring_records
from tvist_lab.whole_file import whole_file

KIND = "foxglove"
"""Name of this format."""


def written_by(path: Path) -> list[Path]:
    """Return the files that an export to `path` writes: the recording, and its layout."""
    return [path, path.with_name(f"{path.name.removesuffix('.mcap')}-layout.json")]


def export(content: RecordingFile, path: Path) -> list[str]:
    """Write a recording with channels for viewers, and a layout for it, replacing both files.

    The channels are `frames` (`foxglove.FrameTransforms`, 50 a second), `arm` (`foxglove.SceneUpdate`, once) and
    `curves` (`tvist.curves`, every tick), each behind `tvist/<robot>/`. All else is as it was: what reads recordings
    reads this file, too.

    Args:
        content: The recording.
        path: File to write.

    Returns:
        What is missing in the added channels, in sentences.

    Raises:
        RecordingError: The recording does not say what its robot looks like.
        ExportError: A file cannot be written. None has changed then, except that the layout may be new.
    """
    arm = arm_of(content)
    stood, stiff = angles(content.recording, arm)
    drawn, lacking = curves(content.recording)
    seen, frames = scene(arm), list(transforms(arm, stood))
    examples: dict[str, tuple[str, Any]] = {
        of_layout.ARM: ("foxglove.SceneUpdate", seen),
        of_layout.FRAMES: (
            "foxglove.FrameTransforms",
            json.loads(frames[0][1]) if frames else {"transforms": []},
        ),
        of_layout.CURVES: ("tvist.curves", dict.fromkeys(CURVES, 0.0)),
    }
    added = {of_layout.FRAMES: frames, of_layout.CURVES: drawn}
    _, beside = written_by(path)
    try:
        with whole_file(beside) as stream:
            stream.write(json.dumps(of_layout.layout(content.robot, arm), indent=1).encode())
        with whole_file(path) as stream:
            copy = _Copy(stream)
            own = {
                end: copy.open(of_layout.topic(content.robot, end), name, example)
                for end, (name, example) in examples.items()
            }
            first = [(own[of_layout.ARM], json.dumps(seen).encode())]
            first += [(own[of_layout.FRAMES], frame) for _, frame in frames[:1]]
            copy.all_of(content.path, first, merge(*(_on(own[end], found) for end, found in added.items())))
    except OSError as error:
        raise ExportError(f"{path} cannot be written: {error.strerror or error}") from error
    return [*stiff, *lacking]


def _on(channel: int, messages: Iterable[Stamped]) -> Iterator[tuple[int, int, bytes]]:
    return ((time, channel, message) for time, message in messages)


@dataclass
class _Copy:
    """Writes a copy of a recording with further channels."""

    stream: IO[bytes]
    topics: set[str] = field(default_factory=set)
    """Topics of the channels of ours, which an exported file that is exported again has already."""

    def __post_init__(self) -> None:
        self._writer = Writer(self.stream, enable_data_crcs=True)
        self._writer.start(library=f"tvist {LIBRARY_IDENTIFIER}")

    def open(self, topic: str, name: str, example: Any) -> int:
        """Open a channel for messages like an example."""
        self.topics.add(topic)
        schema = json.dumps({"title": name} | schema_of(example)).encode()
        number = self._writer.register_schema(name, SchemaEncoding.JSONSchema, schema)
        return self._writer.register_channel(topic, MessageEncoding.JSON, number)

    def all_of(
        self, path: Path, first: list[tuple[int, bytes]], added: Iterator[tuple[int, int, bytes]]
    ) -> None:
        """Copy all records up to the end or a damage of the file, and put others among them.

        Args:
            path: The recording.
            first: Channel and content of messages that stand before all others, so that a viewer which has just opened
                the file shows them.
            added: Time [ns], channel and content of other messages, in the order of time.
        """
        schemas: dict[int, Schema] = {}
        channels: dict[int, int] = {}
        told: set[str] = set()
        waiting = next(added, None)
        try:
            with opened(path) as streams:
                for record in ring_records(streams):
                    match record:
                        case Message(channel_id=channel, log_time=time) if channel in channels:
                            for number, data in first:
                                self._writer.add_message(number, time, data, time)
                            first = []
                            while waiting is not None and waiting[0] <= time:
                                self._put(*waiting)
                                waiting = next(added, None)
                            self._writer.add_message(
                                channels[channel], time, record.data, record.publish_time, record.sequence
                            )
                        case Schema(id=number):
                            schemas[number] = record
                        case Channel(id=number, topic=topic) if (
                            number not in channels and topic not in self.topics
                        ):
                            channels[number] = self._writer.register_channel(
                                topic,
                                record.message_encoding,
                                self._schema(schemas.get(record.schema_id)),
                                record.metadata,
                            )
                        case Metadata(name=name) if (
                            name not in told
                        ):  # that of a ring's older file comes first
                            told.add(name)
                            self._writer.add_metadata(name, record.metadata)
        except DAMAGE:  # the recording's own note says where it ends
            pass
        for one in (waiting, *added) if waiting is not None else ():
            self._put(*one)
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _schema(self, schema: Schema | None) -> int:
        return (
            0 if schema is None else self._writer.register_schema(schema.name, schema.encoding, schema.data)
        )

    def _put(self, time: int, channel: int, data: bytes) -> None:
        self._writer.add_message(channel, time, data, time)
