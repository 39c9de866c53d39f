"""Columns of a robot's log, from any file, as a recording."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tvist_lab.recordings import checks
from tvist_lab.recordings.checks import ACCELEROMETER, TIME, WIDTHS, LogError, is_measured
from tvist_lab.recordings.recording import Floats, Recording
from tvist_lab.words import counted
from tvist_plant.user_file import is_name

OURS = ("tick", "reference_q", "unshaped_q", "target_q", "actual_TCP_pose")
"""Columns that only recordings of this controller have, all together."""
STRANGE = "is no log that tvist reads"
"""What is said first of a file that is something else."""
LONG_GAP = 0.02
"""Shortest time without rows that a note reports [s]."""

SWAPPED = 3
"""Largest number of rows by which one may stand too late or too early in a file to be put in its place."""
SHOWN = 6
"""Largest number of missing entries of a vector that a note names."""

_INDEXED = re.compile(r"(?P<name>.*\D)_(?P<index>\d{1,6})", re.ASCII)


@dataclass(frozen=True)
class Needs:
    """What a log must have beside its times."""

    columns: tuple[str, ...]
    """Vectors, of which one must be there."""
    option: str
    """How to name columns that have other names."""
    positions: str
    """How to say where they are in a file without a header."""


ROBOT = Needs(("target_q", "actual_q"), "--columns time=…,q=joint_{}", "--columns time=1,q=2-7")
ROBOT_OR_SENSOR = Needs((*ROBOT.columns, ACCELEROMETER), ROBOT.option, ROBOT.positions)
SENSOR = Needs(
    (ACCELEROMETER,), "--imu-columns time=…,accelerometer=a{}", "--imu-columns time=1,accelerometer=2-4"
)


@dataclass(frozen=True)
class Rows:
    """Numbers of a log as they stand in its file."""

    path: Path
    names: Sequence[str]
    """Names of the columns; those of a vector end in `_0`, `_1`, …"""
    values: Floats
    """Shape (T, columns); NaN for an empty cell."""
    lines: Floats
    """Number of the line or packet in which each row stands, shape (T,)."""
    unit: str = "line"
    """What `lines` counts, for messages."""
    notes: tuple[str, ...] = ()
    """What the reader of the file left out."""
    needs: Needs = ROBOT
    header: Sequence[str] = ()
    """Names that the file itself gives its columns, where they differ."""


def recording_of(rows: Rows) -> Recording:
    """Join the columns of each vector, and check and number the rows.

    Rows that repeat the time of the row before them, or have no time, are left out, and neighbours that were swapped
    are sorted by their time; notes count them.

    Raises:
        LogError: A number is beyond 1e6; there is no time or nothing of what the log needs, fewer than two rows, or
            time goes back or is not in seconds.
    """
    checks.check_names(rows.path, rows.names)
    columns, notes = _vectors(rows)
    if TIME not in columns or columns[TIME].ndim != 1:
        raise LogError(f"{rows.path} has no column {TIME}: {_remedy(rows)}")
    if not any(name in columns and columns[name].ndim == 2 for name in rows.needs.columns):
        if rows.needs == ROBOT and ACCELEROMETER in columns:
            raise LogError(
                f"{rows.path} holds an accelerometer alone, no joint angles: tvist log analyze measures frequency and "
                "damping from it, and --imu joins it with a robot's log"
            )
        lacking = [f"{name}_0 …" for name in rows.needs.columns]
        has = f"neither {' nor '.join(lacking)}" if len(lacking) > 1 else f"no {lacking[0]}"
        raise LogError(f"{rows.path} has {has}: {_remedy(rows)}")
    kept, more = _increasing(rows, columns[TIME])
    notes += more
    columns = {name: column[kept] for name, column in columns.items()}
    place = rows.unit, rows.lines[kept]
    checks.check_period(rows.path, float(np.median(np.diff(columns[TIME]))))
    checks.check_numbers(rows.path, {TIME: columns[TIME]}, place)
    ours = all(name in columns for name in OURS)
    if not ours:
        columns["tick"], gaps = ticks_of(columns[TIME])
        notes += gaps
        columns = _shaped(columns)
    recording = Recording(columns, notes=(*rows.notes, *notes), foreign=not ours)
    checks.check_recording(rows.path, recording, place)
    return recording


def check_known(path: Path, line: int, names: Sequence[str], needs: Needs) -> None:
    """Refuse a text none of whose columns has a name of a robot's log, which is some other text mostly."""
    if not any(name == TIME or is_measured(name) for name in names):
        found = f"; {found_columns(names)}" if all(map(is_name, names)) else ""
        raise LogError(
            f"{path} {STRANGE}: its line {line} has none of the names that are known, as in timestamp,actual_q_0. "
            f"If it is a log, name its columns with {needs.option}{found}"
        )


def _remedy(rows: Rows) -> str:
    return f"name them with {rows.needs.option}; {found_columns(rows.header or rows.names)}"


def found_columns(names: Sequence[str]) -> str:
    """Return the names of a file's columns as the part of a sentence."""
    there = [name for name in names if name]
    return f"its columns are {', '.join(there[:24])}{', …' if len(there) > 24 else ''}"


def _vectors(rows: Rows) -> tuple[dict[str, Floats], list[str]]:
    """Columns by name, vectors joined; a vector with missing entries is left out, joint angles keep what is there."""
    places: dict[str, dict[int, int]] = {}
    columns: dict[str, Floats] = {}
    for place, name in enumerate(rows.names):
        found = _INDEXED.fullmatch(name)
        if not name:
            continue
        if found is None:
            columns[name] = rows.values[:, place]
        else:
            places.setdefault(found["name"], {})[int(found["index"])] = place
    notes = []
    for name, entries in places.items():
        order = sorted(entries)
        expected = range(max(order[-1] + 1, WIDTHS.get(name, 0)))
        if (count := len(expected) - len(order)) > 0:
            first = islice((f"{name}_{index}" for index in expected if index not in entries), SHOWN)
            missing = [*first, f"{count - SHOWN} more"] if count > SHOWN else [*first]
            joints = name.endswith(("_q", "_qd", "_qdd", "_moment", "_current"))
            what = "the other joints count" if joints else f"{name} is left out"
            notes.append(f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing: {what}")
            if not joints:
                continue
        columns[name] = rows.values[:, [entries[index] for index in order]]
    return columns, notes


def _increasing(rows: Rows, time: Floats) -> tuple[NDArray[np.intp], list[str]]:
    """Indices of the rows that count, and notes about the others."""
    notes = []
    timed = np.flatnonzero(np.isfinite(time))
    if len(timed) < len(time):
        first = int(rows.lines[np.flatnonzero(~np.isfinite(time))[0]])
        notes.append(_left_out(rows, len(time) - len(timed), f"without {TIME}", first))
    step = np.diff(time[timed])
    order = np.argsort(time[timed], kind="stable")
    away = np.abs(order - np.arange(len(order)))
    if 0 < np.max(away, initial=0) <= SWAPPED:
        first = int(rows.lines[timed[np.flatnonzero(step < 0.0)[0] + 1]])
        notes.append(
            f"{counted(int(np.count_nonzero(step < 0.0)), 'row')} out of order sorted by {TIME}, the first in "
            f"{rows.unit} {first}"
        )
        timed = timed[order]
        step = np.diff(time[timed])
    if (back := np.flatnonzero(step < 0.0)).size:
        row = timed[back[0] + 1]
        raise LogError(
            f"{rows.path}, {rows.unit} {int(rows.lines[row])}: {TIME} goes back from {time[timed[back[0]]]:.6g} to "
            f"{time[row]:.6g} s; split the file there, since it contains two logs"
        )
    if (again := np.flatnonzero(step == 0.0)).size:
        first = int(rows.lines[timed[again[0] + 1]])
        notes.append(_left_out(rows, again.size, f"with the {TIME} of the row before", first))
    kept = np.delete(timed, again + 1)
    if kept.size < 2:
        raise LogError(
            f"{rows.path} has {counted(kept.size, 'row')} with a {TIME} of its own; two are needed"
        )
    return kept, notes


def _left_out(rows: Rows, count: int, what: str, first: int) -> str:
    return f"{counted(count, 'row')} {what} left out, the first in {rows.unit} {first}"


def ticks_of(time: Floats) -> tuple[Floats, list[str]]:
    """Number the rows by their time, so that missing rows are missing numbers, and describe long gaps."""
    step = np.diff(time)
    period = float(np.median(step))
    ticks = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(step / period), 1.0))])
    long = np.flatnonzero(step > max(LONG_GAP, 2.5 * period))
    if not long.size:
        return ticks, []
    worst = long[np.argmax(step[long])]
    note = (
        f"rows are missing in {counted(long.size, 'place')}, most of them for {step[worst]:.3f} s "
        f"after {time[worst]:.6g} s"
    )
    return ticks, [note]


def _shaped(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """In RTDE of this controller, `shaped_q` is the target that the arm gets and `target_q` the one before shaping."""
    renamed = dict(columns)
    if "shaped_q" in renamed and "target_q" in renamed:
        renamed["reference_q"] = renamed["target_q"]
        for name in ("q", "qd", "qdd"):
            if f"shaped_{name}" in renamed:
                renamed[f"target_{name}"] = renamed.pop(f"shaped_{name}")
    return renamed
