"""Reader of recordings: MCAP files of one robot, complete or truncated."""

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

from tvist_lab.recordings.recording import Recording, RecordingError
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
"""Longest accepted record [bytes], so that a damaged length cannot exhaust the memory."""

_TOPIC = re.compile(r"tvist/(?P<robot>[^/]+)/(?P<kind>\w+)")
_KINDS: dict[str, type[State | Event | Truth | Entry]] = {tag(k): k for k in (State, Event, Truth, Entry)}
_DAMAGE = (McapError, ZstdError, ValueError, OverflowError, MemoryError)
"""Exceptions for a damaged record: a wrong checksum is a ValueError, and a length may exceed the memory."""


class RecordingFileError(RecordingError):
    """The file is not a recording of a robot."""


@dataclass(frozen=True)
class RecordingFile:
    """Content of a recording."""

    robot: str
    """Name of the robot."""
    info: Info | None
    """Description of the robot when the recording began; None in a file of another program."""
    start: dict[str, Any] | None
    """How the robot's server was started; None in a file of another program."""
    states: tuple[State, ...]
    """Recorded states, at least one; NaN for numbers that were not finite."""
    events: tuple[Event, ...]
    """Recorded events."""
    truths: tuple[Truth, ...]
    """Recorded truth; empty unless the robot published it."""
    journal: tuple[Entry, ...]
    """Inputs of the controller."""
    complete: bool
    """Whether the file was closed properly, and read to its end."""
    dropped: Mapping[str, int] | None
    """Number of messages that the recorder dropped, by kind; None if the file does not contain it."""
    note: str | None
    """A sentence if something is missing."""

    @cached_property
    def recording(self) -> Recording:
        """Return states, truth and events as columns."""
        return Recording.from_states(self.states, self.events, self.truths, self.info)


def read(path: str | os.PathLike[str]) -> RecordingFile:
    """Read a recording. A truncated or damaged file is read up to the damage, which `note` reports.

    Raises:
        RecordingFileError: The file cannot be opened, is not an MCAP file, or contains no state or the states of
            several robots.
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
    """Content read so far."""

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
    """Yield records in order; those of a chunk only if the whole chunk is intact."""
    for record in StreamReader(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=RECORD_LIMIT
    ).records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record
