"""Recordings on disk: MCAP files of one robot, whole or cut short, back into memory."""

import os
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from tvist_lab.recordings import Recording, RecordingError
from tvist_protocol.channels import tag
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import END_METADATA, FORMAT, METADATA, JsonReader
from tvist_protocol.stream import Event, State, Truth

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of every MCAP file."""
RECORD_LIMIT = 2**28
"""Longest record believed [bytes]: a damaged length must not ask for all memory."""

_TOPIC = re.compile(r"tvist/(?P<robot>[^/]+)/(?P<kind>\w+)")
_KINDS: dict[str, type[State | Event | Truth | Entry]] = {tag(k): k for k in (State, Event, Truth, Entry)}
_DAMAGE = (McapError, ZstdError, ValueError, OverflowError, MemoryError)
"""What an altered record raises: a false checksum is a ValueError, a length may be beyond memory."""


class RecordingFileError(RecordingError):
    """A file that is no recording of a robot."""


@dataclass(frozen=True)
class RecordingFile:
    """What stands in a file."""

    robot: str
    """Name of the robot."""
    info: Info | None
    """The robot when the recording began; None in a file of another program."""
    start: dict[str, Any] | None
    """How its server was started; None in a file of another program."""
    states: tuple[State, ...]
    """Recorded states, at least one; NaN where a number was not finite."""
    events: tuple[Event, ...]
    """Recorded events."""
    truths: tuple[Truth, ...]
    """Recorded truth; empty unless the robot published it."""
    journal: tuple[Entry, ...]
    """What reached the controller."""
    complete: bool
    """Whether the file was closed properly, and read to its end."""
    dropped: Mapping[str, int] | None
    """Messages the recorder had no room for, by kind; None where the file does not say."""
    note: str | None
    """A sentence where something is missing."""

    @cached_property
    def recording(self) -> Recording:
        """States, truth and events as columns."""
        return Recording.from_states(self.states, self.events, self.truths, self.info)


def read(path: str | os.PathLike[str]) -> RecordingFile:
    """Read a recording. What is cut short or damaged is read up to there, and says so.

    Raises:
        RecordingFileError: It cannot be opened, is no MCAP file, holds none or several robots' states, or no
            state at all.
    """
    path = Path(path)
    content = _Content(path)
    try:
        with path.open("rb") as stream:
            if (first := stream.read(len(MAGIC))) != MAGIC:
                raise RecordingFileError(f"{path} is {'no MCAP file' if first else 'empty'}")
            stream.seek(0)
            content.read(stream)
    except OSError as error:
        raise RecordingFileError(f"{path} cannot be read: {error.strerror}") from error
    return content.file()


@dataclass
class _Content:
    """What has been read so far."""

    path: Path
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    messages: dict[str, list[Any]] = field(default_factory=lambda: {kind: [] for kind in _KINDS})
    robot: str | None = None
    damage: str | None = None
    readers: dict[int, tuple[JsonReader[Any], list[Any]]] = field(default_factory=dict)

    def read(self, stream: IO[bytes]) -> None:
        try:
            for record in _records(stream):
                self._take(record)
        except RecordingFileError:
            raise
        except (EndOfFile, struct.error):
            self.damage = "was not closed"
        except _DAMAGE as error:
            self.damage = f"is damaged ({error or type(error).__name__})"
        except ProtocolError as error:
            self.damage = f"contains an invalid message ({error.why})"

    def file(self) -> RecordingFile:
        if self.robot is None:
            raise self._error("has no channel tvist/<robot>/state")
        states: list[State] = self.messages[tag(State)]
        if not states:
            raise self._error("holds no state")
        ours = self.metadata.get(METADATA)
        dropped = self._dropped()
        return RecordingFile(
            robot=self.robot,
            info=None if ours is None else self._json(ours, "info", Info),
            start=None if ours is None else self._json(ours, "start", dict[str, Any]),
            states=tuple(states),
            events=tuple(self.messages[tag(Event)]),
            truths=tuple(self.messages[tag(Truth)]),
            journal=tuple(self.messages[tag(Entry)]),
            complete=self.damage is None,
            dropped=dropped,
            note=self._note(states[-1], dropped),
        )

    def _take(self, record: McapRecord) -> None:
        match record:
            case Message(channel_id=channel, data=data):
                if channel in self.readers:
                    reader, messages = self.readers[channel]
                    messages.append(reader.read(data))
            case Channel():
                self._open(record)
            case Metadata(name=name, metadata=content):
                self.metadata[name] = content
                if name == METADATA and content.get("format") != FORMAT:
                    raise self._error(f"has format {content.get('format')}; {FORMAT} can be read")

    def _open(self, channel: Channel) -> None:
        found = _TOPIC.fullmatch(channel.topic)
        if found is None or found["kind"] not in _KINDS or channel.message_encoding != "json":
            return
        if self.robot not in (None, found["robot"]):
            raise self._error(f"contains several robots, {self.robot} and {found['robot']}")
        if found["kind"] == tag(State):
            self.robot = found["robot"]
        self.readers.setdefault(channel.id, (JsonReader(_KINDS[found["kind"]]), self.messages[found["kind"]]))

    def _dropped(self) -> dict[str, int] | None:
        counts = self.metadata.get(END_METADATA)
        try:
            return None if counts is None else {kind: int(count) for kind, count in counts.items()}
        except ValueError as error:
            raise self._error(f"has no valid {END_METADATA}: {error}") from error

    def _json(self, metadata: Mapping[str, str], name: str, kind: Any) -> Any:
        try:
            return checked(parse_json(metadata[name].encode()), kind)
        except KeyError as error:
            raise self._error(f"has no {name}") from error
        except ProtocolError as error:
            raise self._error(f"has no valid {name}: {error.why}") from error

    def _note(self, last: State, dropped: Mapping[str, int] | None) -> str | None:
        notes = [] if self.damage is None else [f"{self.damage}; it could be read up to tick {last.tick}"]
        if lost := {kind: count for kind, count in (dropped or {}).items() if count}:
            counts = ", ".join(f"{count} of {kind}" for kind, count in lost.items())
            notes.append(f"lacks messages the recorder had no room for: {counts}")
        return f"{self.path} {'; '.join(notes)}" if notes else None

    def _error(self, what: str) -> RecordingFileError:
        also = f"; it {self.damage}" if self.damage else ""
        return RecordingFileError(f"{self.path} {what}{also}")


def _records(stream: IO[bytes]) -> Iterator[McapRecord]:
    """Records in order; those of a chunk only if the whole of it is sound."""
    for record in StreamReader(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=RECORD_LIMIT
    ).records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record
