"""Convert a log's numbers as stored in its file to a recording: names, units, gaps."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tvist_lab.phrases import counted
from tvist_lab.recordings import checks
from tvist_lab.recordings.checks import ACCELEROMETER, TIME, WIDTHS, LogError, is_measured
from tvist_lab.recordings.columns import TIMES, found_columns, in_si, rtde_names
from tvist_lab.recordings.description import Description
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_plant.user_file import is_name

OURS = ("tick", "reference_q", "unshaped_q", "target_q", "actual_TCP_pose")
"""Columns that together identify a recording of this controller."""
STRANGE = "is no log that tvist reads"  # start of the error message for a file of another format
LONG_GAP = 0.02  # shortest gap between rows that a note reports [s]
SWAPPED = 3  # largest number of rows by which a misplaced row may be moved to its place
SHOWN = 6  # largest number of a vector's missing entries that a note names

_INDEXED = re.compile(r"(?P<name>.*\D)_(?P<index>\d{1,6})", re.ASCII)


@dataclass(frozen=True)
class Needs:
    """What a log must have besides its times."""

    columns: tuple[str, ...]  # vectors of which at least one must exist
    option: str  # option that gives the names of columns
    positions: str  # option that gives the columns' positions in a file without a header


ROBOT = Needs(("target_q", "actual_q"), "--columns time=…,q=joint_{}", "--columns time=1,q=2-7")
ROBOT_OR_SENSOR = Needs((*ROBOT.columns, ACCELEROMETER), ROBOT.option, ROBOT.positions)
SENSOR = Needs(
    (ACCELEROMETER,), "--imu-columns time=…,accelerometer=a{}", "--imu-columns time=1,accelerometer=2-4"
)


@dataclass(frozen=True)
class LogTable:
    """Numbers of a log as stored in its file."""

    path: Path
    names: Sequence[str]  # columns' names, for entries of vectors with `_0`, `_1`, …; empty without a header
    values: Floats  # shape (T, columns); NaN for an empty cell
    lines: Floats  # number of the line, row or packet of each row, shape (T,)
    unit: str = "row"  # what `lines` counts, for messages
    header: int = 0  # number of the line with the names; 0 if there is none
    notes: tuple[str, ...] = ()  # notes on what the reader of the file left out
    texts: Mapping[int, str] = field(default_factory=dict)
    """Columns with text, by index, each with the error message in case the column is needed."""
    rtde: bool = False  # whether the format has RTDE's names and SI units by definition
    there: str = ""  # description of the file's content if it has no columns, for an error message
    description: Description | None = None


Reader = Callable[[Path], LogTable | Recording]
READERS: dict[str | bytes, Reader] = {}  # readers by file ending, first bytes, `BINARY` or `TEXT`
BINARY, TEXT = "binary", "text"


def reader(*kinds: str | bytes) -> Callable[[Reader], Reader]:
    """Register a reader of files with some endings or first bytes; `read` imports the modules in `formats`."""

    def register(read: Reader) -> Reader:
        READERS.update(dict.fromkeys(kinds, read))
        return read

    return register


def to_recording(table: LogTable, columns: str | None = None, needs: Needs = ROBOT) -> Recording:
    """Name the columns, convert them to SI, join vectors, and check and number the rows.

    Rows that repeat the time before, or have none, are left out, and swapped neighbours are sorted by time;
    notes count them. Raises LogError if the log lacks what `needs` lists.
    """
    if (exported := _exported(table)) is not None:
        return exported
    names, values, notes = _named(table, columns, needs)
    found, more = _vectors(names, values)
    notes += more
    if TIME not in found or found[TIME].ndim != 1:
        raise LogError(f"{table.path} has no column {TIME}: {_remedy(table, needs)}")
    if not any(name in found and found[name].ndim == 2 for name in needs.columns):
        raise _lacking(table, found, needs)
    kept, more = _increasing(table, found[TIME])
    notes += more
    found = {name: column[kept] for name, column in found.items()}
    place = table.unit, table.lines[kept]
    checks.check_period(table.path, float(np.median(np.diff(found[TIME]))))
    checks.check_numbers(table.path, {TIME: found[TIME]}, place)
    ours = all(name in found for name in OURS)
    if not ours:
        found["tick"], gaps = ticks_of(found[TIME])
        notes += gaps
        found = _shaped(found)
    recording = Recording(found, notes=(*table.notes, *notes), foreign=not ours)
    checks.check_recording(table.path, recording, place)
    return recording


def _exported(table: LogTable) -> Recording | None:
    """Return the described recording if the description fits the table, else None."""
    if table.description is None:
        return None
    try:
        recording = table.description.recording(table.names, table.values)
    except RecordingError:
        return None
    if recording is not None:
        checks.check_recording(table.path, recording)
        recording = recording.noted(*table.notes)
    return recording


def _named(table: LogTable, columns: str | None, needs: Needs) -> tuple[list[str], Floats, list[str]]:
    """Return RTDE's names (empty for ignored columns), values in SI, and notes."""
    if not table.names and columns is None:
        first = table.lines[0] if len(table.lines) else 1.0
        raise LogError(
            f"{table.path}, {table.unit} {first:.0f}: there must be a header with RTDE's names, as in "
            f"timestamp,actual_q_0; without one, say where columns are, counted from 1: {needs.positions}"
        )
    header = list(table.names) or [str(place) for place in range(1, table.values.shape[1] + 1)]
    names, units, notes = header, dict[str, str](), tuple[str, ...]()
    if not table.rtde:
        names, units, notes = rtde_names(table.path, header, columns)
    elif columns is not None:
        notes = ("its columns have names, so those given were not used",)
    _check_header(table, header, names if columns is None else [TIME], needs)
    if not len(table.values):
        what = f"no complete row: {table.notes[0]}" if table.notes else "no rows"
        raise LogError(f"{table.path} holds {what}")
    for place, why in table.texts.items():
        if names[place] == TIME or (names[place] if columns else is_measured(names[place])):
            others = f"; name another column of times with --columns time=…: {found_columns(header, place)}"
            raise LogError(f"{why}{others if header[place].lower() in TIMES else ''}")
    if table.texts:
        names = ["" if place in table.texts else name for place, name in enumerate(names)]
        there = ", ".join(header[place] for place in table.texts)
        notes = (*notes, f"columns that hold text are left out: {there}")
    values, converted = (table.values, ()) if table.rtde else in_si(names, table.values, units)
    return names, values, [*notes, *converted]


def _check_header(table: LogTable, header: Sequence[str], names: Sequence[str], needs: Needs) -> None:
    """Refuse a header without any name of a robot's log, or with names that cannot be printed."""
    line, there = "it", f"{table.path}"
    if table.header:
        line, there = f"its line {table.header}", f"{table.path}, line {table.header}"
    if not any(name == TIME or is_measured(name) for name in names):
        found = f"; {found_columns(names)}" if all(map(is_name, names)) else ""
        raise LogError(
            f"{table.path} {STRANGE}: {line} has none of the names that are known, as in timestamp,actual_q_0. "
            f"If it is a log, name its columns with {needs.option}{found}"
        )
    checks.check_names(there, header)
    if twice := sorted(name for name, count in Counter(header).items() if name and count > 1):
        raise LogError(f"{there}: the column {twice[0]} is there twice: rename one")


def _lacking(table: LogTable, found: Mapping[str, Floats], needs: Needs) -> LogError:
    if needs == ROBOT and ACCELEROMETER in found:
        return LogError(
            f"{table.path} holds an accelerometer alone, no joint angles: tvist log analyze measures frequency and "
            "damping from it, and --imu joins it with a robot's log"
        )
    lacking = [f"{name}_0 …" for name in needs.columns]
    has = f"neither {' nor '.join(lacking)}" if len(lacking) > 1 else f"no {lacking[0]}"
    return LogError(f"{table.path} has {has}: {_remedy(table, needs)}")


def _remedy(table: LogTable, needs: Needs) -> str:
    return table.there or f"name them with {needs.option}; {found_columns(table.names)}"


def _vectors(names: Sequence[str], values: Floats) -> tuple[dict[str, Floats], list[str]]:
    """Join vectors; those with missing entries are dropped, but joint angles keep what exists. Also return notes."""
    places: dict[str, dict[int, int]] = {}
    columns: dict[str, Floats] = {}
    for place, name in enumerate(names):
        found = _INDEXED.fullmatch(name)
        if not name:
            continue
        if found is None:
            columns[name] = values[:, place]
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
        columns[name] = values[:, [entries[index] for index in order]]
    return columns, notes


def _increasing(table: LogTable, time: Floats) -> tuple[NDArray[np.intp], list[str]]:
    """Return the indices of usable rows, and notes about the others."""
    notes = []
    timed = np.flatnonzero(np.isfinite(time))
    if len(timed) < len(time):
        first = int(table.lines[np.flatnonzero(~np.isfinite(time))[0]])
        notes.append(_left_out(table, len(time) - len(timed), f"without {TIME}", first))
    step = np.diff(time[timed])
    order = np.argsort(time[timed], kind="stable")
    if 0 < np.max(np.abs(order - np.arange(len(order))), initial=0) <= SWAPPED:
        first = int(table.lines[timed[np.flatnonzero(step < 0.0)[0] + 1]])
        notes.append(
            f"{counted(int(np.count_nonzero(step < 0.0)), 'row')} out of order sorted by {TIME}, the first in "
            f"{table.unit} {first}"
        )
        timed = timed[order]
        step = np.diff(time[timed])
    if (back := np.flatnonzero(step < 0.0)).size:
        row = timed[back[0] + 1]
        raise LogError(
            f"{table.path}, {table.unit} {int(table.lines[row])}: {TIME} goes back from {time[timed[back[0]]]:.6f} to "
            f"{time[row]:.6f} s; split the file there, since it contains two logs"
        )
    if (again := np.flatnonzero(step == 0.0)).size:
        first = int(table.lines[timed[again[0] + 1]])
        notes.append(_left_out(table, again.size, f"with the {TIME} of the row before", first))
    kept = np.delete(timed, again + 1)
    if kept.size < 2:
        raise LogError(
            f"{table.path} has {counted(kept.size, 'row')} with a {TIME} of its own; two are needed"
        )
    return kept, notes


def _left_out(table: LogTable, count: int, what: str, first: int) -> str:
    return f"{counted(count, 'row')} {what} left out, the first in {table.unit} {first}"


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
    """Rename columns of our RTDE, where `shaped_q` is the target and `target_q` the reference before shaping."""
    renamed = dict(columns)
    if "shaped_q" in renamed and "target_q" in renamed:
        renamed["reference_q"] = renamed["target_q"]
        for name in ("q", "qd", "qdd"):
            if f"shaped_{name}" in renamed:
                renamed[f"target_{name}"] = renamed.pop(f"shaped_{name}")
    return renamed
