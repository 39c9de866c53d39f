"""Records of an MCAP file in order, complete or truncated."""

import struct
from collections.abc import Iterator
from typing import IO

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of every MCAP file."""
RECORD_LIMIT = 2**28
"""Longest accepted record [bytes], so that a damaged length cannot exhaust the memory."""
CUT = (EndOfFile, struct.error)
"""Exceptions for a file that ends too early."""
DAMAGE = (*CUT, McapError, ZstdError, ValueError, OverflowError, MemoryError)
"""Exceptions for a damaged record: a wrong checksum is a ValueError, and a length may exceed the memory."""


def records(stream: IO[bytes]) -> Iterator[McapRecord]:
    """Yield records in order; those of a chunk only if the whole chunk is intact."""
    for record in StreamReader(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=RECORD_LIMIT
    ).records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record
