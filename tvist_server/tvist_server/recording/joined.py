"""Index of an MCAP file that was written without one, and join of two such files, without decompressing a chunk."""

import os
import struct
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import msgspec
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import breakup_chunk

from tvist_protocol.channels import tag
from tvist_protocol.recorded import END_METADATA
from tvist_server.recording.kept import MAGIC, RECORD

BUFFER = 2**20
"""Number of bytes copied at once."""

_MESSAGE_INDEX = struct.Struct("<HI")
"""Beginning of a message index: its channel, and the length of its entries, 16 bytes each."""


@dataclass
class _Index:
    """What the summary of a file contains."""

    chunks: list[ChunkIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    first_chunk: int = 0
    """Where the first chunk begins."""
    end: int = 0
    """Where the last whole record before the end of the data ends."""


def complete(path: Path, following: Path | None, dropped: Mapping[type[msgspec.Struct], int]) -> None:
    """Append the chunks of another file to a file, if there is one, then its end and an index.

    Args:
        path: The file.
        following: File with the same schemas and channels; it is only read.
        dropped: Number of messages that the recorder dropped, by kind.

    Raises:
        OSError: A file cannot be read or written. `path` can then be read up to where it was written.
    """
    with path.open("r+b") as stream:
        index = _index(stream)
        stream.truncate(index.end)
        stream.seek(index.end)
        if following is not None:
            _append(stream, index, following)
        place = stream.tell()
        kinds = {name.rsplit(".", 1)[-1] for name in (schema.name for schema in index.schemas.values())}
        counts = dict.fromkeys(sorted(kinds), "0") | {
            tag(kind): str(count) for kind, count in dropped.items()
        }
        end = _bytes(Metadata(name=END_METADATA, metadata=counts))
        stream.write(end)
        index.metadata.append(MetadataIndex(place, len(end), END_METADATA))
        stream.write(_bytes(DataEnd(data_section_crc=0)))
        place = stream.tell()
        stream.write(_summary(index))
        stream.write(_bytes(Footer(summary_start=place, summary_offset_start=0, summary_crc=0)))
        stream.write(MAGIC)


def _append(stream: IO[bytes], index: _Index, following: Path) -> None:
    with following.open("rb") as source:
        more = _index(source)
        shift = index.end - more.first_chunk
        source.seek(more.first_chunk)
        left = more.end - more.first_chunk
        while left > 0 and (data := source.read(min(left, BUFFER))):
            stream.write(data)
            left -= len(data)
    for chunk in more.chunks:
        chunk.chunk_start_offset += shift
        chunk.message_index_offsets = {key: at + shift for key, at in chunk.message_index_offsets.items()}
    index.chunks += more.chunks
    index.counts += more.counts
    index.schemas |= more.schemas
    index.channels |= more.channels


def _index(stream: IO[bytes]) -> _Index:
    """Go through a file from record to record."""
    index = _Index(end=len(MAGIC))
    size = os.fstat(stream.fileno()).st_size
    while index.end + RECORD.size <= size:
        stream.seek(index.end)
        kind, length = RECORD.unpack(stream.read(RECORD.size))
        after = index.end + RECORD.size + length
        if kind == Opcode.DATA_END or after > size:
            break
        if kind in (Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.METADATA):
            _note(index, kind, stream.read(length))
        index.end = after
    return index


def _note(index: _Index, kind: int, data: bytes) -> None:
    content = ReadDataStream(BytesIO(data))
    length = len(data) + RECORD.size
    if kind == Opcode.METADATA:
        index.metadata.append(MetadataIndex(index.end, length, Metadata.read(content).name))
    elif kind == Opcode.CHUNK:
        chunk = Chunk.read(content)
        if not index.chunks:  # it begins with the schemas and channels
            index.first_chunk = index.end
            for record in breakup_chunk(chunk):
                if isinstance(record, Schema):
                    index.schemas[record.id] = record
                elif isinstance(record, Channel):
                    index.channels[record.id] = record
        index.chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=index.end,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )
    else:
        channel, size = _MESSAGE_INDEX.unpack_from(data)
        chunk_index = index.chunks[-1]
        chunk_index.message_index_offsets[channel] = index.end
        chunk_index.message_index_length += length
        index.counts[channel] += size // 16


def _summary(index: _Index) -> bytes:
    chunks = index.chunks
    statistics = Statistics(
        attachment_count=0,
        channel_count=len(index.channels),
        channel_message_counts=dict(index.counts),
        chunk_count=len(chunks),
        message_count=index.counts.total(),
        message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
        metadata_count=len(index.metadata),
        schema_count=len(index.schemas),
    )
    records = [*index.schemas.values(), *index.channels.values(), statistics, *chunks, *index.metadata]
    return b"".join(map(_bytes, records))


def _bytes(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
