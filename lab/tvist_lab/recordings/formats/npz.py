"""Read arrays saved by NumPy, with one row for each time."""

import io
import math
import zipfile
from pathlib import Path

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from tvist_lab.recordings.checks import LogError
from tvist_lab.recordings.formats.parquet import check_size, reason
from tvist_lab.recordings.recording import Floats
from tvist_lab.recordings.table import LogTable, reader


@reader(".npz")
def read_npz(path: Path) -> LogTable:
    """Read numeric arrays with one or two dimensions, which must have equal numbers of rows."""
    try:
        with zipfile.ZipFile(path) as file:
            check_size(path, sum(entry.file_size for entry in file.infolist()) // 8)
            arrays = {name.removesuffix(".npy"): _array(file.read(name)) for name in file.namelist()}
    except LogError:
        raise
    except Exception as error:  # a damaged file can raise nearly anything
        raise LogError(f"{path} cannot be read: {reason(error)}") from error
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
    """Decode an array, which cannot claim more numbers than it has."""
    stream = io.BytesIO(data)
    header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
    shape, by_columns, kind = header(stream)
    flat = np.frombuffer(data, kind, math.prod(shape), stream.tell())
    return flat.reshape(shape, order="F" if by_columns else "C")
