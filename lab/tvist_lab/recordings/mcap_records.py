"""Read the records of MCAP files in order, complete or truncated."""

import re
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import IO

import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import CRCValidationError, StreamReader
from zstandard import ZstdError, frame_content_size

from tvist_lab.recordings.recording import RecordingError
from tvist_protocol.recorded import segment_name, segment_of

MAGIC = b"\x89MCAP0\r\n"
RECORD_LIMIT = 2**28
"""Longest accepted record and unpacked chunk [bytes], so that a damaged length cannot exhaust the memory."""
DENSEST, LEAST = 500, 1 << 16
"""Largest ratio of a chunk's content to its size, and additional bytes; a robot at rest reaches 90. A chunk
may hold about as many records as bytes: otherwise a small file could take minutes and all memory."""
CUT = (EndOfFile, struct.error)  # exceptions for a file that ends too early
DAMAGE = (*CUT, McapError, ZstdError, ValueError, OverflowError, MemoryError)
"""Exceptions for a damaged record: a wrong checksum is a ValueError, and a length may exceed the memory."""

_RECORD = struct.Struct("<BQ")  # start of a record: its kind and length
_MESSAGE = struct.Struct("<HIQQ")  # start of a message: its channel, number and two times
TOPIC = re.compile(r"tvist/(?P<robot>[^/]+)/(?P<kind>\w+)")
WILD = "*?["  # characters that make a name a pattern


class _Records(StreamReader):
    """Reads all records except indexes, which take as long as messages and are useless for reading everything."""

    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode in (Opcode.MESSAGE_INDEX, Opcode.CHUNK_INDEX):
            self._stream.read(length)
            return None
        # Read the record from a buffer, so that damaged lengths inside it cannot exceed the record.
        whole, self._stream = self._stream, ReadDataStream(BytesIO(self._stream.read(length)))
        try:
            return super()._read_record(opcode, length)
        finally:
            self._stream = whole


def records(stream: IO[bytes]) -> Iterator[McapRecord]:
    """Yield records in order; those of a chunk only if the whole chunk is intact."""
    for record in _Records(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=RECORD_LIMIT
    ).records:
        if isinstance(record, Chunk):
            yield from _records_of(record)
        else:
            yield record


def _records_of(chunk: Chunk) -> list[McapRecord]:
    """Return messages, channels and schemas of a chunk; several times faster than the library's function."""
    data = _unpacked(chunk)
    found: list[McapRecord] = []
    place, length, most = 0, len(data), 100 + len(chunk.data)
    while place < length:
        if (most := most - 1) < 0:
            raise ValueError(f"a chunk of {len(chunk.data)} bytes holds more records than bytes")
        kind, size = _RECORD.unpack_from(data, place)
        place += _RECORD.size
        if (after := place + size) > length:
            raise EndOfFile
        if kind == Opcode.MESSAGE:
            channel, sequence, time, publish_time = _MESSAGE.unpack_from(data, place)
            found.append(Message(channel, time, data[place + _MESSAGE.size : after], publish_time, sequence))
        elif kind in (Opcode.CHANNEL, Opcode.SCHEMA):
            content = ReadDataStream(BytesIO(data[place:after]))
            found.append(Channel.read(content) if kind == Opcode.CHANNEL else Schema.read(content))
        place = after
    return found


def _unpacked(chunk: Chunk) -> bytes:
    """Unpack a chunk, but never more than the size it claims."""
    size, data = chunk.uncompressed_size, chunk.data
    if size > min(RECORD_LIMIT, LEAST + DENSEST * len(data)):
        raise ValueError(f"a chunk of {len(data)} bytes claims {size}")
    if chunk.compression == "zstd":
        if frame_content_size(data) > size:
            raise ValueError("a chunk has more than it claims")
        data = zstandard.decompress(data, size)
    elif chunk.compression == "lz4":
        try:
            data = LZ4FrameDecompressor().decompress(data, max_length=size)
        except RuntimeError as error:
            raise ValueError(str(error)) from error
    if chunk.uncompressed_crc not in (0, found := zlib.crc32(data)):
        raise CRCValidationError(chunk.uncompressed_crc, found, chunk)
    return data


def files_of(path: Path) -> tuple[Path, ...]:
    """Return the files of the recording that a path names, in order.

    A path is a file, a folder, a pattern such as `run-2-part*.mcap`, or the name of a recording with
    segments; of the latter, the latest run is taken. Raises RecordingError unless the path names one
    recording without missing segments.
    """
    if path.is_dir():
        found = list(path.glob("*.mcap"))
    elif path.exists():
        return (path,)
    else:
        segments = [(segment_of(file.name), file) for file in path.parent.glob("*")]
        runs = {segment[1] for segment, _ in segments if segment is not None and segment[0] == path.name}
        found = [
            file for segment, file in segments if segment and segment[:2] == (path.name, max(runs, default=0))
        ]
        if not found and not any(char in path.name for char in WILD):
            return (path,)
        found = found or list(path.parent.glob(path.name))
    names = sorted({_run_of(file) for file in found})
    if len(names) != 1:
        several = f"{len(names)} recordings, {', '.join(names)}: give one of them"
        there = several if names else "no recording: no MCAP file is there"
        raise RecordingError(f"{path} names {there}")
    files = tuple(sorted(found, key=lambda file: (len(file.name), file.name)))
    numbers = [segment[2] for file in files if (segment := segment_of(file.name)) is not None]
    for before, after in pairwise(numbers):
        if after != before + 1:
            why = f"lacks segment {before + 1} of {names[0]}: give the files before or behind it"
            raise RecordingError(f"{path} {why}")
    return files


def _run_of(file: Path) -> str:
    """Return the name of a file's recording, as a pattern if it is a segment."""
    segment = segment_of(file.name)
    return file.name if segment is None else segment_name(*segment[:2], None)


@contextmanager
def opened(files: Sequence[Path]) -> Iterator[Sequence[IO[bytes]]]:
    """Open the files of a recording together, so that the oldest can be read even if it is deleted meanwhile."""
    with ExitStack() as stack:
        streams = []
        for file in files:
            try:
                streams.append(stack.enter_context(file.open("rb")))
            except FileNotFoundError:
                if file == files[-1]:
                    raise
        yield streams


def all_records(streams: Sequence[IO[bytes]]) -> Iterator[McapRecord]:
    """Yield the records of all files in order; damage is raised only at the end."""
    damage = None
    for stream in streams:
        try:
            yield from records(stream)
        except DAMAGE as error:
            damage = error
    if damage is not None:
        raise damage
