"""Read the content of a log that may be compressed with gzip."""

import zlib
from pathlib import Path

from tvist_lab.recordings.checks import LogError

GZIP = b"\x1f\x8b"
DENSEST = 100  # largest ratio of the content to the size of its file; logs reach 30, a malicious file 1000
MIN_CONTENT = 1 << 20  # size of the content that any file may have [bytes]


def content(path: Path) -> bytes:
    """Return a file's content, decompressed; of a truncated file, the available part."""
    data = path.read_bytes()
    if not data.startswith(GZIP):
        return data
    room, parts = MIN_CONTENT + DENSEST * len(data), list[bytes]()
    while data.startswith(GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            parts.append(unpacker.decompress(data, room))
        except zlib.error as error:
            raise LogError(f"{path} is compressed by gzip and damaged: {error}") from None
        if unpacker.unconsumed_tail:
            raise LogError(f"{path} grows beyond {DENSEST} times its size: decompress it with gunzip")
        room -= len(parts[-1])
        data = unpacker.unused_data if room > 0 else b""
    return b"".join(parts)
