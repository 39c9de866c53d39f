"""Parquet is read in a process of its own: a damaged file can crash the reader, and then only this process ends.

`python -m tvist_lab.recordings.apart FILE` writes names and arrays of the file as npz, or says why it cannot.
"""

import io
import math
import os
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.lib import format as npy
from numpy.typing import NDArray

from tvist_lab.recordings.description import KEY

Arrays = dict[str, NDArray[Any]]

DENSEST = 2000
"""Largest size of the content over that of its file; deflation reaches 1032, recordings a tenth of it."""
LEAST_CONTENT = 1 << 20
"""Size of the content that any file may have [bytes]."""


def read_apart(path: Path) -> Arrays:
    """Return the arrays of a Parquet file.

    Raises:
        ValueError: The file cannot be read.
    """
    child = subprocess.run(  # noqa: S603  this program itself
        [sys.executable, "-P", "-m", __name__, path],  # -P: import nothing from the folder one works in
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        check=False,
    )
    if child.returncode:
        raise ValueError(
            child.stdout.decode(errors="replace")
            or f"its reader ended with {child.returncode}: it is damaged"
        )
    names, *arrays = unpacked(io.BytesIO(child.stdout)).values()
    return dict(zip(names.tolist(), arrays, strict=True))


def unpacked(stream: Path | io.BytesIO) -> Arrays:
    """Return the arrays of an npz, which may claim no more numbers than it has.

    Raises:
        Exception: Of nearly any type, if the file is damaged.
    """
    with zipfile.ZipFile(stream) as file:
        if isinstance(stream, Path):
            check_size(stream, sum(entry.file_size for entry in file.infolist()) // 8)
        return {name.removesuffix(".npy"): _array(file.read(name)) for name in file.namelist()}


def check_size(path: Path, numbers: int) -> None:
    """Refuse a file that claims more numbers than can be packed into one of its size.

    Raises:
        ValueError: It does.
    """
    most = (LEAST_CONTENT + DENSEST * path.stat().st_size) // 8
    if numbers > most:
        raise ValueError(f"it claims {numbers:g} numbers, a file of its size holds at most {most}")


def in_words(error: BaseException) -> str:
    """Return what an error of a library says, as the part of a sentence."""
    said = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    return textwrap.shorten(said, 300, placeholder=" …")


def _array(data: bytes) -> NDArray[Any]:
    stream = io.BytesIO(data)
    header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
    shape, by_columns, kind = header(stream)
    flat = np.frombuffer(data, kind, math.prod(shape), stream.tell())
    return flat.reshape(shape, order="F" if by_columns else "C")


def _parquet(path: Path) -> Arrays:
    rows, columns = pl.scan_parquet(path).select(pl.len()).collect().item(), pl.read_parquet_schema(path)
    check_size(path, rows * len(columns))
    text = pl.read_parquet_metadata(path).get(KEY)
    numeric = pl.selectors.numeric() | pl.selectors.boolean()
    table = pl.read_parquet(path).with_columns(pl.selectors.array().arr.to_list())
    for column in table.select(pl.selectors.list()):
        width = int(np.max(column.list.len().fill_null(0).to_numpy(), initial=0))
        check_size(path, rows * width)
        entries = [column.list.get(at, null_on_oob=True).alias(f"{column.name}_{at}") for at in range(width)]
        table = table.drop(column.name).hstack(entries)
    arrays = {
        column.name: column.cast(pl.Float64).fill_null(np.nan).to_numpy() for column in table.select(numeric)
    }
    return arrays if text is None else arrays | {KEY: np.array(text)}


def _main(path: Path) -> int:
    try:
        arrays = _parquet(path)
        packed = io.BytesIO()
        np.savez(packed, np.array(list(arrays), np.str_), *arrays.values())
    except (Exception, pl.exceptions.PanicException) as error:  # noqa: BLE001  a damaged file can raise nearly anything
        sys.stdout.buffer.write(in_words(error).encode())
        return 1
    sys.stdout.buffer.write(packed.getbuffer())
    return 0


if __name__ == "__main__":
    sys.exit(_main(Path(sys.argv[1])))
