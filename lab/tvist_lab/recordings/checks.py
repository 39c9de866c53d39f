"""Check recordings from files once, on reading: size, names, numbers, shapes, times."""

import re
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_plant.user_file import is_name
from tvist_protocol.errors import quoted

TIME = "timestamp"  # name of the column of times, as in RTDE [s]
ACCELEROMETER, GYROSCOPE = "actual_tool_accelerometer", "actual_tool_gyroscope"
"""Names of the signals of a sensor at the tool; RTDE has only the first."""
WIDTHS = {
    "actual_TCP_pose": 6, "target_TCP_pose": 6, "actual_TCP_speed": 6, ACCELEROMETER: 3, GYROSCOPE: 3,
}  # fmt: skip
"""Number of entries that a vector needs to be usable; joint angles have one per joint."""
ANGLES = ("reference_q", "unshaped_q", "target_q", "actual_q")  # vectors with one entry per joint
SHAPES = {name: (width,) for name, width in WIDTHS.items()}
LARGEST = {TIME: 1e10, "tick": 2.0**53}
"""Largest times [s] and ticks: three centuries after 1970, and the range of exact integers in a float."""
MEASURED = re.compile(
    r"(actual|target|shaped|reference|unshaped|motor|truth)_(motor_)?(q|qd|qdd|moment|current|(TCP|tool|flange)_\w+)(_\d+)?"
    r"|(estimated|flange|payload|shaper|speed_scaling|truth_\w*(deflection|poses))\w*"
)  # names of columns in SI units
MAX_VALUE = 1e6  # largest number in such a column; more is damage
LONG_GAP = 1.0  # longest gap between rows that is filled with straight lines [s]; a longer one splits the log
Places = tuple[str, Floats]
"""Position of rows in a file: what is counted, such as "line", and the number of each row, shape (T,)."""
GZIP = b"\x1f\x8b"
DENSEST = 100  # largest ratio of a packed log's content to its size; logs reach 30, a malicious file 1000
MIN_CONTENT = 1 << 20  # size of the content that any file may have [bytes]
PERIODS = (1e-4, 0.1)  # shortest and longest time between rows [s]


class LogError(RecordingError):
    """A file is no measurable log; the message names the file and, if there is one, the line."""


def content(path: Path) -> bytes:
    """Return a file's content, decompressed if it is gzip; of a truncated file, the available part."""
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


def is_measured(name: str) -> bool:
    """Whether a column of a table is an entry of a vector of measured or desired values."""
    return name[-1:].isdigit() and MEASURED.fullmatch(name) is not None


def check_names(where: object, names: Sequence[str]) -> None:
    """Refuse a name that cannot be printed, as in a damaged file."""
    for name in names:
        if not is_name(name):
            raise LogError(f"{where}: {quoted(name)} is no name of a column: must be short and printable")


def check_numbers(path: Path, columns: Mapping[str, Floats], places: Places) -> None:
    """Refuse a number that no robot has; NaN means missing."""
    for name, values in columns.items():
        most = LARGEST.get(name, MAX_VALUE if MEASURED.fullmatch(name) else np.inf)
        if len(strange := np.argwhere(np.abs(values) > most)):
            row, *entry = strange[0].tolist()
            where = f"{path}, {places[0]} {places[1][row]:.0f}, column {'_'.join([name, *map(str, entry)])}"
            raise LogError(
                f"{where}: {values[(row, *entry)]:g} in SI units is not plausible: must be at most {most:g}"
            )


def check_period(path: Path, period: float) -> None:
    """Refuse a period that is too short or too long, since times may not be in seconds."""
    if not PERIODS[0] <= period <= PERIODS[1]:
        raise LogError(
            f"{path}: {TIME} grows by {period:.3g} from row to row: it must be in seconds, with a row every "
            f"{PERIODS[0]:g} to {PERIODS[1]:g} s"
        )


def check_recording(path: Path, recording: Recording, places: Places | None = None) -> None:
    """Refuse a recording that cannot be analysed; `places`: rows' positions in the file, by default ticks."""
    info, columns, tick, time = recording.info, recording.columns, recording["tick"], recording.time
    check_names(path, [*columns, *([] if info is None else [info.name, info.model, info.version])])
    joints = max((columns[name].shape[1:] for name in ANGLES if name in columns), default=())
    for name, shape in {TIME: (), "tick": (), **dict.fromkeys(ANGLES, joints or (1,)), **SHAPES}.items():
        if name in columns and ((found := columns[name].shape[1:]) != shape or 0 in shape):
            raise LogError(f"{path}: column {name} has rows of the shape {found}: must be {shape}")
    if not len(tick) or not np.isfinite(time).all() or not np.array_equal(tick, np.round(np.abs(tick))):
        raise LogError(f"{path}: its rows lack a {TIME}, or the number of their tick")
    check_numbers(path, columns, places or ("tick", tick))
    if len(tick) < 2:
        return
    step = np.diff(time)
    periods = step / np.diff(tick)
    if (back := np.flatnonzero(step <= 0.0)).size:
        before, after = time[back[0] : back[0] + 2]
        raise LogError(
            f"{path}, tick {tick[back[0] + 1]:.0f}: {TIME} goes from {before:.6f} to {after:.6f} s: must increase"
        )
    # The clock of another controller need not agree with its ticks.
    for period in (np.median(periods), recording.period, *([] if recording.foreign else [np.max(periods)])):
        check_period(path, float(period))
