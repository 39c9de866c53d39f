"""Records of an MCAP file in order, complete or truncated, and of the two files of a ring."""

import re
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from io import BytesIO
from itertools import islice
from os import fstat
from os.path import samestat
from pathlib import Path
from typing import IO

import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader
from zstandard import ZstdError, frame_content_size

from tvist_protocol.channels import tag
from tvist_protocol.recorded import METADATA, RING, earlier_name
from tvist_protocol.stream import State

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of every MCAP file."""
RECORD_LIMIT = 2**28
"""Longest accepted record, and unpacked chunk [bytes], so that a damaged length cannot exhaust the memory."""
DENSEST, LEAST = 500, 1 << 16
"""A chunk may unpack to so many times its size, and so many bytes more; a robot at rest reaches 90. It may hold as many
records as it has bytes, and some more: else a small file takes minutes, and the memory."""
CUT = (EndOfFile, struct.error)
"""Exceptions for a file that ends too early."""
DAMAGE = (*CUT, McapError, ZstdError, ValueError, OverflowError, MemoryError)
"""Exceptions for a damaged record: a wrong checksum is a ValueError, and a length may exceed the memory."""

_RECORD = struct.Struct("<BQ")
"""Beginning of a record: its kind, and its length."""
_MESSAGE = struct.Struct("<HIQQ")
"""Beginning of a message: its channel, number and two times."""
TOPIC = re.compile(r"tvist/(?P<robot>[^/]+)/(?P<kind>\w+)")
"""Topic of a robot's channel."""
BEFORE_METADATA = 3
"""Number of records at the beginning of a file among which is the metadata of a recording."""


class _Records(StreamReader):
    """Reads all records but indexes, which take as long as the messages and are of no use to who reads them all."""

    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode in (Opcode.MESSAGE_INDEX, Opcode.CHUNK_INDEX):
            self._stream.read(length)
            return None
        # The lengths of its parts then end with the record, whatever they claim.
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
    """Messages, channels and schemas of a chunk; several times faster than the library's own function."""
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
    """Content of a chunk, of which never more is unpacked than it claims to have.

    Raises:
        ValueError: It claims too much or has something else, as the checksum shows.
        ZstdError: It is damaged.
    """
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


@contextmanager
def opened(path: Path) -> Iterator[Sequence[IO[bytes]]]:
    """Open a recording, and before it the file with its older part if there is one.

    The newer file is opened first: if it takes the older one's place meanwhile, both are the same, and nothing between
    them is missed.

    Raises:
        OSError: A file cannot be opened.
    """
    with ExitStack() as stack:
        newer = stack.enter_context(path.open("rb"))
        earlier = path.with_name(earlier_name(path.name))
        if not _is_ring(newer) or not earlier.exists():
            yield (newer,)
            return
        older = stack.enter_context(earlier.open("rb"))
        yield (newer,) if samestat(fstat(newer.fileno()), fstat(older.fileno())) else (older, newer)


def ring_records(streams: Sequence[IO[bytes]]) -> Iterator[McapRecord]:
    """Yield the records of one file after those of the other.

    While both are joined, the older one also contains messages of the newer one: those up to its last state are left
    out of the newer one. A damage of the older file is raised when both have been read.
    """
    last, damage = -1, None
    for stream in streams[:-1]:
        channels: set[int] = set()
        try:
            for record in records(stream):
                match record:
                    case Message(channel_id=channel, log_time=time) if channel in channels:
                        last = time
                    case Channel(id=channel, topic=topic):
                        found = TOPIC.fullmatch(topic)
                        if found is not None and found["kind"] == tag(State):
                            channels.add(channel)
                yield record
        except DAMAGE as error:
            damage = error
    for record in records(streams[-1]):
        if not isinstance(record, Message) or record.log_time > last:
            yield record
    if damage is not None:
        raise damage


def _is_ring(stream: IO[bytes]) -> bool:
    try:
        first = list(islice(records(stream), BEFORE_METADATA))
    except DAMAGE:
        return False
    finally:
        stream.seek(0)
    return any(isinstance(r, Metadata) and r.name == METADATA and RING in r.metadata for r in first)
