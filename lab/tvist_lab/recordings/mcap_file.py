"""Read the recording of one robot: an MCAP file or several segments, complete or truncated."""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import IO, Any, TypeVar

from mcap.records import Channel, McapRecord, Message, Metadata

from tvist_lab.recordings.checks import check_names, check_recording
from tvist_lab.recordings.mcap_records import CUT, DAMAGE, MAGIC, TOPIC, all_records, files_of, opened
from tvist_lab.recordings.messages import Block, JsonColumns, recording_of_blocks
from tvist_lab.recordings.recording import Recording, RecordingError
from tvist_protocol.channels import tag
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import BEHAVIOUR, END_METADATA, FORMAT, FROM_TICK, METADATA, JsonReader
from tvist_protocol.stream import Event, State, Truth

BLOCK = 8192  # number of messages decoded together; some 12 MB

_TABLES: dict[str, type[State | Truth | Io]] = {tag(kind): kind for kind in (State, Truth, Io)}
"""Kinds of messages that become columns."""
_OBJECTS: dict[str, type[Event | Entry]] = {tag(kind): kind for kind in (Event, Entry)}
"""Kinds of messages that are few and become objects."""
Published = State | Truth | Event | Io  # a message that the robot published
_Kind = TypeVar("_Kind", State, Truth, Io)


class RecordingFileError(RecordingError):
    """The file is not a recording of a robot."""


@dataclass(frozen=True)
class RecordingFile:
    """Content of a recording."""

    path: Path  # file, folder or pattern that names the recording
    files: tuple[Path, ...]
    robot: str
    info: Info | None  # description of the robot at the start; None in a foreign file
    start: dict[str, Any] | None  # start options of the robot's server; None in a file of another program
    behaviour: int  # number of the robot's behaviour, see `tvist_protocol.recorded.THIS_BEHAVIOUR`
    counts: Mapping[str, int]  # number of messages `state`, `truth` and `io`; at least one state
    events: tuple[Event, ...]
    journal: tuple[Entry, ...]  # inputs of the controller
    recording: Recording  # states, truth and events as columns, with inputs and outputs if they were recorded
    from_tick: int | None
    """First tick of a recording that lacks earlier ticks; None if it starts with the robot's first tick."""
    complete: bool  # whether the file was closed properly and read to its end
    dropped: Mapping[str, int] | None  # dropped messages by kind; None if unknown
    note: str | None  # note if something is missing

    @cached_property
    def states(self) -> tuple[State, ...]:
        """Recorded states, read from the file again; NaN for numbers that were not finite."""
        return tuple(self.again(State))

    @cached_property
    def truths(self) -> tuple[Truth, ...]:
        """Recorded truth; empty unless the robot published it."""
        return tuple(self.again(Truth))

    def again(self, kind: type[_Kind], *others: type[Published]) -> Iterator[Any]:
        """Read messages of some kinds again, in order, up to the last one of the first kind."""
        left = self.counts[tag(kind)]
        readers: dict[str, JsonReader[Any]] = {tag(one): JsonReader(one) for one in (kind, *others)}
        channels: dict[int, JsonReader[Any]] = {}
        try:
            with opened(self.files) as streams:
                for record in all_records(streams):
                    match record:
                        case Message(channel_id=channel, data=data) if channel in channels:
                            message = channels[channel].read(data)
                            left -= isinstance(message, kind)
                            if left < 0:
                                return
                            yield message
                        case Channel(topic=topic, message_encoding="json"):
                            found = TOPIC.fullmatch(topic)
                            if found is not None and found["kind"] in readers:
                                channels[record.id] = readers[found["kind"]]
        except OSError as error:
            raise RecordingFileError(f"{error.filename} cannot be read: {error.strerror}") from error
        except (*DAMAGE, ProtocolError):  # the first reading stopped at the same damage
            pass
        if left > 0:
            raise RecordingFileError(f"{self.path} has changed since it was read: read it again")


def read(path: str | os.PathLike[str]) -> RecordingFile:
    """Read a recording; a truncated or damaged file is read up to the damage, with a `note`.

    `path` may be a folder or pattern that names the segments of one recording. Raises RecordingFileError if a
    file cannot be read, is no MCAP file, or does not hold the states of exactly one robot; RecordingError if
    a folder or pattern does not name exactly one recording.
    """
    path = Path(path)
    content = _Content(path, files_of(path))
    try:
        with opened(content.files) as streams:
            if (first := streams[0].read(len(MAGIC))) != MAGIC:
                raise RecordingFileError(f"{content.files[0]} is {'no MCAP file' if first else 'empty'}")
            streams[0].seek(0)
            content.read(streams)
    except OSError as error:
        raise RecordingFileError(f"{error.filename or path} cannot be read: {error.strerror}") from error
    return content.file()


def read_checked(path: str | os.PathLike[str]) -> RecordingFile:
    """Read a recording like `read`, and check it like logs of other controllers."""
    content = read(path)
    check_recording(content.path, content.recording)
    return content


@dataclass
class _Content:
    """The content that has been read."""

    path: Path
    files: tuple[Path, ...]
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    ends: list[dict[str, str]] = field(default_factory=list)  # metadata at the end of each complete file
    tables: dict[str, JsonColumns] = field(
        default_factory=lambda: {name: JsonColumns(kind) for name, kind in _TABLES.items()}
    )
    objects: dict[str, list[Any]] = field(default_factory=lambda: {name: [] for name in _OBJECTS})
    readers: dict[str, JsonReader[Any]] = field(
        default_factory=lambda: {name: JsonReader(kind) for name, kind in (_TABLES | _OBJECTS).items()}
    )
    robot: str | None = None
    damage: str | None = None
    channels: dict[int, str] = field(default_factory=dict)
    waiting: list[tuple[str, bytes]] = field(default_factory=list)  # messages still to decode

    def read(self, streams: Sequence[IO[bytes]]) -> None:
        try:
            try:
                for record in all_records(streams):
                    self._take(record)
            except RecordingFileError:
                raise
            except CUT:
                self.damage = "was not closed"
            except DAMAGE as error:
                self.damage = f"is damaged ({error or type(error).__name__})"
            self._decode()
        except ProtocolError as error:
            self.damage = f"contains an invalid message ({error.why})"

    def file(self) -> RecordingFile:
        if self.robot is None:
            raise self._error("has no channel tvist/<robot>/state")
        counts = {name: len(table) for name, table in self.tables.items()}
        if not counts[tag(State)]:
            raise self._error("holds no state")
        ours = self.metadata.get(METADATA)
        dropped = self._dropped()
        info = None if ours is None else self._json(ours, "info", Info)
        start = None if ours is None else self._json(ours, "start", dict[str, Any])
        events = tuple(self.objects[tag(Event)])
        states = self.tables[tag(State)].all()
        truths, io = (self.tables[tag(kind)].all() if counts[tag(kind)] else None for kind in (Truth, Io))
        return RecordingFile(
            path=self.path,
            files=self.files,
            robot=self.robot,
            info=info,
            start=start,
            behaviour=1 if ours is None else self._integer(ours, BEHAVIOUR) or 1,
            counts=counts,
            events=events,
            journal=tuple(self.objects[tag(Entry)]),
            recording=recording_of_blocks(states, truths, io, events, info),
            from_tick=None if ours is None else self._integer(ours, FROM_TICK),
            complete=self.damage is None,
            dropped=dropped,
            note=self._note(states, dropped),
        )

    def _take(self, record: McapRecord) -> None:
        match record:
            case Message():
                if (kind := self.channels.get(record.channel_id)) is not None:
                    self.waiting.append((kind, record.data))
                    if len(self.waiting) >= BLOCK:
                        self._decode()
            case Channel():
                self._decode()
                self._open(record)
            case Metadata(name=name, metadata=content):
                self._decode()
                self.metadata.setdefault(name, content)  # take the value of the first segment
                if name == END_METADATA:
                    self.ends.append(content)
                if name == METADATA and content.get("format") != FORMAT:
                    raise self._error(f"has format {content.get('format')}: must be {FORMAT}")

    def _decode(self) -> None:
        waiting, self.waiting = self.waiting, []
        try:
            self._keep(waiting)
        except ProtocolError:
            for index, (kind, data) in enumerate(waiting):
                try:
                    self.readers[kind].read(data)
                except ProtocolError:
                    self._keep(waiting[:index])
                    raise
            raise

    def _keep(self, messages: list[tuple[str, bytes]]) -> None:
        """Decode messages; keep all of them or none."""
        by_kind: dict[str, list[bytes]] = {}
        for kind, data in messages:
            by_kind.setdefault(kind, []).append(data)
        blocks = {kind: self.tables[kind].decode(by_kind[kind]) for kind in _TABLES if kind in by_kind}
        objects = {
            kind: [self.readers[kind].read(data) for data in by_kind[kind]]
            for kind in _OBJECTS
            if kind in by_kind
        }
        for kind, block in blocks.items():
            self.tables[kind].blocks.append(block)
        for kind, found in objects.items():
            self.objects[kind] += found

    def _open(self, channel: Channel) -> None:
        found = TOPIC.fullmatch(channel.topic)
        if found is None or found["kind"] not in self.readers or channel.message_encoding != "json":
            return
        check_names(self.path, [found["robot"]])
        if self.robot not in (None, found["robot"]):
            raise self._error(f"contains several robots, {self.robot} and {found['robot']}")
        if found["kind"] == tag(State):
            self.robot = found["robot"]
        self.channels.setdefault(channel.id, found["kind"])

    def _dropped(self) -> dict[str, int] | None:
        if len(self.ends) < len(self.files):
            return None
        dropped = Counter[str]()
        for counts in self.ends:
            dropped.update({kind: self._valid(END_METADATA, counts[kind], int) for kind in counts})
        return dict(dropped)

    def _integer(self, ours: Mapping[str, str], name: str) -> int | None:
        return self._valid(name, ours[name], int) if name in ours else None

    def _json(self, ours: Mapping[str, str], name: str, kind: Any) -> Any:
        if name not in ours:
            raise self._error(f"has no {name}")
        return self._valid(name, ours[name], lambda text: checked(parse_json(text.encode()), kind))

    def _valid(self, name: str, text: str, read: Callable[[str], Any]) -> Any:
        try:
            return read(text)
        except (ValueError, ProtocolError) as error:
            raise self._error(f"has no valid {name}: {getattr(error, 'why', error)}") from error

    def _note(self, states: Block, dropped: Mapping[str, int] | None) -> str | None:
        notes = []
        if self.damage is not None:
            notes.append(f"{self.damage}; it could be read up to tick {int(states['tick'][-1])}")
        if lost := {kind: count for kind, count in (dropped or {}).items() if count}:
            counts = ", ".join(f"{count} of {kind}" for kind, count in lost.items())
            notes.append(f"lacks messages the recorder had no room for: {counts}")
        return f"{self.path} {'; '.join(notes)}" if notes else None

    def _error(self, what: str) -> RecordingFileError:
        also = f"; it {self.damage}" if self.damage else ""
        return RecordingFileError(f"{self.path} {what:.300}{also:.300}")
