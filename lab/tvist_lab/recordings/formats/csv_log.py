"""Read logs as text, in CSV and similar formats, as written by UR's record.py, ur_rtde and `tvist log export`."""

import io
import re
from pathlib import Path

import numpy as np
import polars as pl

from tvist_lab.phrases import counted
from tvist_lab.recordings.checks import LogError, content
from tvist_lab.recordings.description import beside
from tvist_lab.recordings.recording import Floats
from tvist_lab.recordings.table import STRANGE, TEXT, LogTable, reader

SEPARATORS = (";", "\t", ",", " ")  # separators of cells, in the order in which they are sought in the header
EMPTY = ("", "nan", "NaN", "NAN", "None", "null", "NULL", "NA", "-")  # cells without a number
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


@reader(TEXT)
def read_csv(path: Path) -> LogTable:
    """Read cells separated by spaces, commas, semicolons or tabs, with or without a header."""
    # Lines with too few or too many cells are left out, and a note names the first. Numbers may have decimal
    # commas if cells have another separator.
    raw = content(path).removeprefix(b"\xef\xbb\xbf")
    all_lines = raw.splitlines()
    top, names, separator = _header(path, all_lines)
    first = top + 1 if names else top
    body = [
        (at, line)
        for at, line in enumerate(all_lines[first:], first + 1)
        if line.strip() and not line.lstrip().startswith(b"#")
    ]
    if separator == " ":
        body = [(at, b" ".join(line.split())) for at, line in body]
    cells = np.array([line.count(separator.encode()) + 1 for _, line in body], dtype=np.int64)
    width = len(names) or int(cells[0])
    whole, notes = cells == width, list[str]()
    torn = np.flatnonzero(~whole)
    if body and separator == "," and np.mean(cells > width) > 0.5:
        whole[:] = False
        notes.append(
            f"line {body[0][0]} has {cells[0]} cells under a header of {width}: are there decimal commas? "
            "Write numbers with a decimal point"
        )
    elif torn.size:
        notes.append(
            f"{counted(torn.size, 'torn line')} left out, the first is line {body[torn[0]][0]} with "
            f"{cells[torn[0]]} cells instead of {width}"
        )
    elif len(body) > 1 and not raw.endswith(b"\n"):
        # The last number may be incomplete.
        whole[-1] = False
        notes.append(f"line {body[-1][0]} has no end and was left out")
    kept = [body[at] for at in np.flatnonzero(whole)]
    text = b"".join(line + b"\n" for _, line in kept)
    numbers = np.array([at for at, _ in kept], dtype=np.float64)
    values, texts = _numbers(text if separator == "," else text.replace(b",", b"."), separator, width)
    return LogTable(
        path, names, values, numbers, "line", top + 1 if names else 0, tuple(notes),
        {
            place: f"{path}, line {numbers[row]:.0f}, column {names[place] if names else place + 1}: "
            f"{cell[:40]!r} is no number"
            for place, (row, cell) in texts.items()
        },
        description=beside(path),
    )  # fmt: skip


def _header(path: Path, lines: list[bytes]) -> tuple[int, list[str], str]:
    """Return the header's index, names and separator; without a header, index and separator of the first row."""
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
    return top, names if any(re.match(r"[^\W\d]", name) for name in names) else [], separator


def _top(lines: list[bytes]) -> int | None:
    """Return the index of the header: the first line without #, or a comment with names right above numbers."""
    above = None
    for at in (at for at, line in enumerate(lines) if line.strip()):
        if not lines[at].lstrip().startswith(b"#"):
            return at if above is None or re.search(rb"[A-DF-Za-df-z_]", lines[at]) else above
        above = at if re.match(rb"[#\s]*\"?[A-Za-z_]\w*[\s\",;]", lines[at]) else None
    return None


def _numbers(text: bytes, separator: str, width: int) -> tuple[Floats, dict[int, tuple[int, str]]]:
    """Return the values of all cells, shape (T, columns), NaN if empty, and the first text in each column with text."""
    names = [str(place) for place in range(width)]
    try:
        frame = _frame(text, separator, dict.fromkeys(names, pl.Float64()))
        return np.asarray(frame.to_numpy().astype(np.float64)), {}
    except pl.exceptions.PolarsError:
        cells = _frame(text, separator, dict.fromkeys(names, pl.String()))
        cells = cells.select(pl.col(names).str.strip_chars().str.strip_chars('"'))
        frame = cells.select(pl.col(names).cast(pl.Float64, strict=False))
    bad = (
        cells.select(pl.col(names).is_not_null() & ~pl.col(names).is_in(EMPTY)).to_numpy()
        & np.array([column.is_null().to_numpy() for column in frame]).T
    )
    rows = {place: int(np.argmax(bad[:, place])) for place in np.flatnonzero(bad.any(axis=0)).tolist()}
    texts = {place: (row, str(cells[row, place])) for place, row in rows.items()}
    return np.asarray(frame.to_numpy().astype(np.float64)), texts


def _frame(text: bytes, separator: str, schema: dict[str, pl.DataType]) -> pl.DataFrame:
    if not text:
        return pl.DataFrame(schema=schema)
    return pl.read_csv(
        io.BytesIO(text),
        has_header=False,
        separator=separator,
        quote_char=None,  # a quote that does not end would hide the lines after it
        schema=schema,
        null_values=list(EMPTY),
        truncate_ragged_lines=True,
        encoding="utf8-lossy",
    )
