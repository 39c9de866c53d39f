"""Read tables in Parquet, and arrays saved by NumPy with one row for each time.

A damaged Parquet file can crash its reader, so it is read in a separate process: `python -m
tvist_lab.recordings.formats.tables FILE` writes the description of the columns on one line, then the numbers as
Arrow; or an error.
"""

import io
import math
import os
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
from numpy.lib import format as npy
from numpy.typing import NDArray

from tvist_lab.recordings.checks import MIN_CONTENT, LogError
from tvist_lab.recordings.description import KEY, described
from tvist_lab.recordings.recording import Floats
from tvist_lab.recordings.table import LogTable, reader

DENSEST = 2000  # largest accepted ratio of content to file size; recordings reach a tenth of this


@reader(".parquet")
def read_parquet(path: Path) -> LogTable:
    """Read the columns of numbers, and of lists of numbers, of a Parquet file."""
    child = subprocess.run(  # noqa: S603  this program itself
        [sys.executable, "-P", "-m", __name__, path],  # -P: import nothing from the folder one works in
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        check=False,
    )
    if child.returncode:
        why = child.stdout.decode(errors="replace")
        raise LogError(
            f"{path} cannot be read: {why or f'its reader ended with {child.returncode}: it is damaged'}"
        )
    text, _, numbers = child.stdout.partition(b"\n")
    frame = pl.read_ipc(io.BytesIO(numbers))
    rows = np.arange(1.0, len(frame) + 1.0)
    return LogTable(path, frame.columns, frame.to_numpy(), rows, description=described(text))


@reader(".npz")
def read_npz(path: Path) -> LogTable:
    """Read numeric arrays with one or two dimensions, which must have equal numbers of rows."""
    try:
        with zipfile.ZipFile(path) as file:
            _check_size(path, sum(entry.file_size for entry in file.infolist()) // 8)
            arrays = {name.removesuffix(".npy"): _array(file.read(name)) for name in file.namelist()}
    except LogError:
        raise
    except Exception as error:  # a damaged file can raise nearly anything
        raise LogError(f"{path} cannot be read: {_reason(error)}") from error
    columns: dict[str, Floats] = {}
    for name, array in arrays.items():
        if array.dtype.kind in "biuf" and array.ndim in (1, 2) and len(array):
            flat = array.astype(np.float64).reshape(len(array), -1)
            wide = flat.shape[1] > 1
            columns |= {f"{name}_{at}" if wide else name: column for at, column in enumerate(flat.T)}
    if len({len(column) for column in columns.values()}) != 1:
        raise LogError(f"{path} holds no columns of numbers of equal lengths")
    values = np.column_stack(list(columns.values()))
    return LogTable(path, list(columns), values, np.arange(1.0, len(values) + 1.0))


def _array(data: bytes) -> NDArray[np.generic]:
    """Decode an array; refuse one that claims more numbers than its data have."""
    stream = io.BytesIO(data)
    header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
    shape, by_columns, kind = header(stream)
    flat = np.frombuffer(data, kind, math.prod(shape), stream.tell())
    return flat.reshape(shape, order="F" if by_columns else "C")


def _check_size(path: Path, numbers: int) -> None:
    """Refuse a file that claims more numbers than its size can hold."""
    most = (MIN_CONTENT + DENSEST * path.stat().st_size) // 8
    if numbers > most:
        raise LogError(
            f"{path} cannot be read: it declares {numbers:g} numbers: must be at most {most} for its size"
        )


def _reason(error: BaseException) -> str:
    """Return a library's error as part of a sentence."""
    said = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    return textwrap.shorten(said, 300, placeholder=" …")


def _numbers(path: Path) -> pl.DataFrame:
    rows, columns = pl.scan_parquet(path).select(pl.len()).collect().item(), pl.read_parquet_schema(path)
    _check_size(path, rows * len(columns))
    table = pl.read_parquet(path).with_columns(pl.selectors.array().arr.to_list())
    for column in table.select(pl.selectors.list()):
        width = int(np.max(column.list.len().fill_null(0).to_numpy(), initial=0))
        _check_size(path, rows * width)
        entries = [column.list.get(at, null_on_oob=True).alias(f"{column.name}_{at}") for at in range(width)]
        table = table.drop(column.name).hstack(entries)
    return table.select((pl.selectors.numeric() | pl.selectors.boolean()).cast(pl.Float64).fill_null(np.nan))


def _main(path: Path) -> int:
    try:
        text, table = pl.read_parquet_metadata(path).get(KEY, ""), io.BytesIO()
        _numbers(path).write_ipc(table)
    except (Exception, pl.exceptions.PanicException) as error:  # noqa: BLE001  a damaged file can raise nearly anything
        sys.stdout.buffer.write(_reason(error).encode())
        return 1
    sys.stdout.buffer.write(text.replace("\n", " ").encode() + b"\n" + table.getbuffer())
    return 0


if __name__ == "__main__":
    sys.exit(_main(Path(sys.argv[1])))
