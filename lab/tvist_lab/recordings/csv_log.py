"""Logs in CSV with RTDE's names, as UR's record.py, ur_rtde and `tvist log export` write them."""

import io
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from tvist_lab.recordings.checks import TIME, LogError, check_names, is_measured
from tvist_lab.recordings.log_columns import (
    ROBOT,
    STRANGE,
    Needs,
    Rows,
    check_known,
    found_columns,
    recording_of,
)
from tvist_lab.recordings.named_columns import in_si, named
from tvist_lab.recordings.packed import content
from tvist_lab.recordings.recording import Floats, Recording
from tvist_lab.recordings.vendor_columns import vendor_of
from tvist_lab.words import counted

SEPARATORS = (";", "\t", ",", " ")
"""Characters between cells, in the order in which they are looked for in the header."""
EMPTY = ("", "nan", "NaN", "NAN", "None", "null", "NULL", "NA", "-")
"""Cells without a number."""
TIMES = ("timestamp", "time", "t")
"""Names of the column of times; the first is RTDE's."""
REALTIME = {
    "q_target": "target_q",
    "qd_target": "target_qd",
    "qdd_target": "target_qdd",
    "M_target": "target_moment",
    "q_actual": "actual_q",
    "qd_actual": "actual_qd",
    "tool_vector_actual": "actual_TCP_pose",
    "TCP_speed_actual": "actual_TCP_speed",
    "tool_accelerometer": "actual_tool_accelerometer",
}
"""Names of UR's real-time interface, and RTDE's for the same."""
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


@dataclass(frozen=True)
class _Lines:
    """Lines of a file that have as many cells as its header."""

    names: list[str]
    separator: str
    text: bytes
    """Complete lines, without the header."""
    numbers: Floats
    """Number of each line in the file, from 1."""
    notes: tuple[str, ...]


def read_csv(path: Path, columns: str | None = None, needs: Needs = ROBOT) -> Recording:
    """Read a log in CSV: separated by spaces, commas, semicolons or tabs, with a header of RTDE's names or others.

    A file without a header has columns with the names 1, 2, …, for those who say what they are.

    Torn lines, which have too few or too many cells, are left out, and a note names the first. Numbers may have decimal
    commas where these do not separate cells.

    Args:
        path: The file.
        columns: Names of its columns, as `named` reads them; None for RTDE's, or those of `VENDORS`.
        needs: What it must have.

    Raises:
        LogError: The file has no header of several names, cells that are no numbers, decimal commas between commas, or
            no rows; or see `named` and `recording_of`.
        OSError: The file cannot be read.
    """
    lines = _lines(path, needs, known=columns is None)
    names, units, whose = _named(path, lines.names, columns)
    needed = [name == TIME or is_measured(name) if columns is None else bool(name) for name in names]
    values, texts = _numbers(path, lines, needed)
    if texts:
        names = ["" if place in texts else name for place, name in enumerate(names)]
        there = ", ".join(lines.names[place] for place in texts)
        whose = (*whose, f"columns that hold text are left out: {there}")
    values, notes = in_si(names, values, units)
    notes = (*lines.notes, *whose, *notes)
    return recording_of(
        Rows(path, names, values, lines.numbers, notes=notes, needs=needs, header=lines.names)
    )


def _named(
    path: Path, header: list[str], columns: str | None
) -> tuple[list[str], dict[str, str], tuple[str, ...]]:
    """RTDE's names of a header's columns, their units, and a note about whose names they are."""
    if columns is not None:
        return *named(path, columns, header), ()
    own = [_rtde_name(name, header) for name in header]
    vendor = vendor_of(header)
    if vendor is None:
        return own, {}, ()
    names, units = named(path, vendor[1], header)
    names = [name or ("" if other in names else other) for name, other in zip(names, own, strict=True)]
    return names, units, (f"the columns have the names of {vendor[0]}",)


def _rtde_name(name: str, names: list[str]) -> str:
    """RTDE's name of a column that has the name of the real-time interface; other names stay."""
    if name.lower() in TIMES and TIMES[0] not in names:
        return TIMES[0]
    stem, _, index = name.rpartition("_")
    return f"{REALTIME[stem]}_{index}" if stem in REALTIME else name


def _lines(path: Path, needs: Needs, *, known: bool) -> _Lines:
    raw = content(path).removeprefix(b"\xef\xbb\xbf")
    ends_whole = raw.endswith(b"\n")
    all_lines = raw.splitlines()
    top, names, separator = _header(path, all_lines, needs, known=known)
    below = enumerate(all_lines[top + 1 :], top + 2)
    body = [(at, line) for at, line in below if line.strip() and not line.lstrip().startswith(b"#")]
    if separator == " ":
        body = [(at, b" ".join(line.split())) for at, line in body]
    cells = np.array([line.count(separator.encode()) + 1 for _, line in body], dtype=np.int64)
    whole = cells == len(names)
    if body and separator == "," and np.mean(cells > len(names)) > 0.5:
        raise LogError(
            f"{path}, line {body[0][0]}: {cells[0]} cells under a header of {len(names)}: are there decimal commas? "
            "Write numbers with a decimal point"
        )
    notes = []
    torn = np.flatnonzero(~whole)
    if torn.size:
        first = body[torn[0]][0]
        notes.append(
            f"{counted(torn.size, 'torn line')} left out, the first is line {first} with "
            f"{cells[torn[0]]} cells instead of {len(names)}"
        )
    elif body and not ends_whole and len(body) > 1:
        # Nobody knows whether the last number is complete.
        whole[-1] = False
        notes.append(f"line {body[-1][0]} has no end and was left out")
    if not whole.any():
        raise LogError(f"{path} holds no rows" if not body else f"{path} holds no complete row: {notes[0]}")
    kept = [body[at] for at in np.flatnonzero(whole)]
    text = b"\n".join(line for _, line in kept) + b"\n"
    return _Lines(
        names,
        separator,
        text if separator == "," else text.replace(b",", b"."),
        np.array([at for at, _ in kept], dtype=np.float64),
        tuple(notes),
    )


def _header(path: Path, lines: list[bytes], needs: Needs, *, known: bool) -> tuple[int, list[str], str]:
    """Index of the header, its names, of which some must be known unless they are given, and what separates them.

    Without a header the index is that of the line before the first row.
    """
    top = _top(lines)
    if top is None:
        raise LogError(f"{path} holds no rows")
    try:
        header = lines[top].decode("utf-8").strip().lstrip("# ")
    except UnicodeDecodeError:
        raise LogError(f"{path} {STRANGE}: its line {top + 1} is no text") from None
    separator = next((one for one in SEPARATORS if one in header), ",")
    if len(cells := header.split()) > 1 and all(map(_NUMBER.fullmatch, cells)):
        separator = " "  # and any comma is a decimal one
    names = [
        name.strip().strip('"') for name in (header.split() if separator == " " else header.split(separator))
    ]
    if len(names) == 1:
        raise LogError(
            f"{path} {STRANGE}: its line {top + 1} has one cell; a header names several, as in timestamp,actual_q_0"
        )
    if not known and all(name in EMPTY or _NUMBER.fullmatch(name) for name in names):
        return top - 1, [str(place) for place in range(1, len(names) + 1)], separator
    if not any(re.match(r"[A-Za-z_]", name) for name in names):
        raise LogError(
            f"{path}, line {top + 1}: there must be a header with RTDE's names, as in timestamp,actual_q_0; without "
            f"one, say where columns are, counted from 1: {needs.positions}"
        )
    if known:
        check_known(path, top + 1, _named(path, names, None)[0], needs)
    check_names(f"{path}, line {top + 1}", names)
    if twice := sorted(name for name, count in Counter(names).items() if name and count > 1):
        raise LogError(f"{path}, line {top + 1}: the column {twice[0]} is there twice")
    return top, names, separator


def _top(lines: list[bytes]) -> int | None:
    """Index of the header: the first line that is no comment, or a comment with names right above numbers."""
    filled = [at for at, line in enumerate(lines) if line.strip()]
    above = None
    for at in filled:
        if not lines[at].lstrip().startswith(b"#"):
            return at if above is None or re.search(rb"[A-DF-Za-df-z_]", lines[at]) else above
        above = at if re.match(rb"[#\s]*\"?[A-Za-z_]\w*[\s\",;]", lines[at]) else None
    return None


def _numbers(path: Path, lines: _Lines, needed: list[bool]) -> tuple[Floats, list[int]]:
    """Values of all cells, shape (T, columns), NaN where one is empty; and columns with text that are not needed."""
    texts: list[int] = []
    names = [str(place) for place in range(len(lines.names))]
    try:
        frame = _frame(lines, dict.fromkeys(names, pl.Float64()))
    except pl.exceptions.PolarsError:
        text = _frame(lines, dict.fromkeys(names, pl.String()))
        text = text.select(pl.col(names).str.strip_chars().str.strip_chars('"'))
        frame = text.select(pl.col(names).cast(pl.Float64, strict=False))
        texts = _check_cells(path, lines, text, frame, needed)
    return np.asarray(frame.to_numpy().astype(np.float64)), texts


def _frame(lines: _Lines, schema: dict[str, pl.DataType]) -> pl.DataFrame:
    return pl.read_csv(
        io.BytesIO(lines.text),
        has_header=False,
        separator=lines.separator,
        quote_char=None,  # a quote that does not end would hide the lines after it
        schema=schema,
        null_values=list(EMPTY),
        truncate_ragged_lines=True,
        encoding="utf8-lossy",
    )


def _check_cells(
    path: Path, lines: _Lines, text: pl.DataFrame, frame: pl.DataFrame, needed: list[bool]
) -> list[int]:
    """Refuse a cell that has something but no number, with its line and column; return columns not needed with such."""
    texts = []
    for place, name in enumerate(lines.names):
        cells, numbers = text.to_series(place), frame.to_series(place)
        bad = (numbers.is_null() & cells.is_not_null() & ~cells.is_in(EMPTY)).arg_true()
        if len(bad) and needed[place]:
            cell = cells[bad[0]]
            where = f"{path}, line {int(lines.numbers[bad[0]])}, column {name}"
            raise LogError(f"{where}: {cell[:40]!r} is no number{_instead(lines, name)}")
        texts += [place] * bool(len(bad))
    return texts


def _instead(lines: _Lines, name: str) -> str:
    """What to do about a column of times that is text."""
    others = found_columns([other for other in lines.names if other != name])
    return f"; name another column of times with --columns time=…: {others}" if name.lower() in TIMES else ""
