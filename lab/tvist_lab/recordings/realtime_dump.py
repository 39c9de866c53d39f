"""Dumps of UR's real-time interface, port 30003: packets as they came over the socket, in a file."""

import struct
from pathlib import Path

import numpy as np

from tvist_lab.recordings.checks import LogError
from tvist_lab.recordings.log_columns import STRANGE, Rows, recording_of
from tvist_lab.recordings.packed import content
from tvist_lab.recordings.recording import Recording

SIZES = (1044, 1060, 1108, 1116, 1140, 1220)
"""Lengths of a packet [bytes], from software 3.0 on; each later one begins like the earlier ones."""
OLD = 812
"""Length of a packet of software 1.8, in another order."""
LAYOUT = (
    ("timestamp", 0, 1),
    ("target_q", 1, 6),
    ("target_qd", 7, 6),
    ("target_qdd", 13, 6),
    ("target_current", 19, 6),
    ("target_moment", 25, 6),
    ("actual_q", 31, 6),
    ("actual_qd", 37, 6),
    ("actual_current", 43, 6),
    ("actual_TCP_pose", 55, 6),
    ("actual_TCP_speed", 61, 6),
    ("actual_TCP_force", 67, 6),
    ("target_TCP_pose", 73, 6),
    ("target_TCP_speed", 79, 6),
    ("robot_mode", 94, 1),
    ("safety_mode", 101, 1),
    ("actual_tool_accelerometer", 108, 3),
    ("speed_scaling", 117, 1),
)
"""RTDE's name, first double after the length, and number of doubles ("Remote Control via TCP/IP", Universal Robots)."""


def read_dump(path: Path) -> Recording:
    """Read a dump of port 30003 of any software from 3.0 on. It may begin and end within a packet.

    Raises:
        LogError: The file contains no packets, or those of software 1.8; or see `recording_of`.
        OSError: The file cannot be read.
    """
    data = content(path)
    starts, size, skipped = _packets(path, data)
    doubles = np.array([np.frombuffer(data, ">f8", (size - 4) // 8, at + 4) for at in starts])
    names: list[str] = []
    places: list[int] = []
    for name, first, count in LAYOUT:
        names += [name] if count == 1 else [f"{name}_{index}" for index in range(count)]
        places += range(first, first + count)
    notes = [f"{skipped} bytes outside complete packets were left out"] if skipped else []
    values = doubles[:, places].astype(np.float64)
    values[~np.isfinite(values)] = np.nan
    numbers = np.arange(1.0, len(starts) + 1.0)
    return recording_of(Rows(path, names, values, numbers, "packet", tuple(notes)))


def _packets(path: Path, data: bytes) -> tuple[list[int], int, int]:
    """First byte of each packet, the packets' length, and the number of bytes that belong to none."""
    first, size = _first(path, data)
    head = struct.pack(">i", size)
    starts, at = [], first
    while 0 <= at <= len(data) - size:
        following = data[at + size : at + size + 4]
        if data.startswith(head, at) and head.startswith(following):
            starts.append(at)
            at += size
        else:  # bytes are missing: this packet is torn
            at = data.find(head, at + 1)
    return starts, size, len(data) - size * len(starts)


def _first(path: Path, data: bytes) -> tuple[int, int]:
    """First byte and length of the first packet that another one follows."""
    for size in (*SIZES, OLD):
        head = struct.pack(">i", size)
        at = data.find(head)
        while 0 <= at <= len(data) - size:
            if at + size == len(data) or data[at + size : at + size + 4] == head[: len(data) - at - size]:
                if size == OLD:
                    raise LogError(
                        f"{path} is a dump of software 1.8 (packets of {OLD} bytes); 3.0 and later are read"
                    )
                return at, size
            at = data.find(head, at + 1)
    raise LogError(
        f"{path} {STRANGE}: no MCAP, no text, and no packets of port 30003 of "
        f"{', '.join(map(str, SIZES))} bytes"
    )
