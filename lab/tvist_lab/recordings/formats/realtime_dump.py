"""Read dumps of UR's real-time interface, port 30003: packets as received from the socket."""

import struct
from pathlib import Path

import numpy as np

from tvist_lab.recordings.checks import LogError, content
from tvist_lab.recordings.table import BINARY, STRANGE, LogTable, reader

SIZES = (1044, 1060, 1108, 1116, 1140, 1220)
"""Lengths of a packet [bytes] since software 3.0; longer packets start with the fields of shorter ones."""
OLD = 812  # length of a packet of software 1.8, whose fields have another order


@reader(BINARY)
def read_dump(path: Path) -> LogTable:
    """Read a dump of any software from 3.0 on; it may start and end within a packet."""
    from tvist_server.gateways.ur.realtime import LAYOUT

    data = content(path)
    starts, size, skipped = _packets(path, data)
    doubles = np.array([np.frombuffer(data, ">f8", (size - 4) // 8, at + 4) for at in starts])
    names, places, first = list[str](), list[int](), 0
    for name, count in LAYOUT:
        if name is not None and first + count <= (SIZES[0] - 4) // 8:  # what packets of every software have
            names += [name] if count == 1 else [f"{name}_{index}" for index in range(count)]
            places += range(first, first + count)
        first += count
    notes = (f"{skipped} bytes outside complete packets were left out",) if skipped else ()
    values = doubles[:, places].astype(np.float64)
    values[~np.isfinite(values)] = np.nan
    return LogTable(path, names, values, np.arange(1.0, len(starts) + 1.0), "packet", notes=notes, rtde=True)


def _packets(path: Path, data: bytes) -> tuple[list[int], int, int]:
    """Return the first byte of each packet, the packets' length, and the number of bytes outside packets."""
    first, size = _first(path, data)
    head = struct.pack(">i", size)
    starts, at = [], first
    while 0 <= at <= len(data) - size:
        if data.startswith(head, at) and head.startswith(data[at + size : at + size + 4]):
            starts.append(at)
            at += size
        else:  # bytes are missing: this packet is torn
            at = data.find(head, at + 1)
    return starts, size, len(data) - size * len(starts)


def _first(path: Path, data: bytes) -> tuple[int, int]:
    """Return first byte and length of the first packet that is followed by another packet."""
    for size in (*SIZES, OLD):
        head = struct.pack(">i", size)
        at = data.find(head)
        while 0 <= at <= len(data) - size:
            if at + size == len(data) or data[at + size : at + size + 4] == head[: len(data) - at - size]:
                if size == OLD:
                    raise LogError(
                        f"{path} is a dump of software 1.8 (packets of {OLD} bytes): must be of 3.0 or later"
                    )
                return at, size
            at = data.find(head, at + 1)
    raise LogError(
        f"{path} {STRANGE}: no MCAP, no text, and no packets of port 30003 of "
        f"{', '.join(map(str, SIZES))} bytes"
    )
