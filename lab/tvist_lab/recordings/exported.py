"""Recordings from Parquet, npz and mat: those that `tvist export` wrote, and others with columns of RTDE's names."""

import os
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from tvist_lab.recordings.description import KEY, Description, checked_description, described, sidecar
from tvist_lab.recordings.log_columns import Rows, recording_of
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_protocol.content import parse_json
from tvist_protocol.errors import ProtocolError


class ExportedError(RecordingError):
    """A file is no recording that was exported; the message names it."""


def read_parquet(path: str | os.PathLike[str]) -> Recording:
    """Read a table in Parquet.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    path = Path(path)
    try:
        text = pl.read_parquet_metadata(path).get(KEY)
        table = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise ExportedError(f"{path} cannot be read: {_reason(error)}") from error
    numeric = [column for column in table if column.dtype.is_numeric() or column.dtype == pl.Boolean]
    flat = {column.name: column.cast(pl.Float64).fill_null(np.nan).to_numpy() for column in numeric}
    if text is None:
        return _log(path, flat)
    description = _described(path, text)
    columns = {}
    for name, about in description.columns.items():
        names = [name] if about.width is None else [f"{name}_{index}" for index in range(about.width)]
        if missing := [entry for entry in names if entry not in flat]:
            raise ExportedError(f"{path} has no column {missing[0]}, which its description names")
        parts = [flat[entry] for entry in names]
        columns[name] = parts[0] if about.width is None else _joined(parts, len(table))
    return _recording(path, description, columns)


def read_npz(path: str | os.PathLike[str]) -> Recording:
    """Read arrays that NumPy saved.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, AttributeError) as error:
        raise ExportedError(f"{path} cannot be read: {_reason(error)}") from error
    return _of_arrays(path, arrays)


def read_mat(path: str | os.PathLike[str]) -> Recording:
    """Read a MAT-file of version 4 to 7.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    from scipy.io import loadmat

    path = Path(path)
    try:
        arrays = loadmat(path, chars_as_strings=True)
    except NotImplementedError as error:
        raise ExportedError(f"{path} is of MATLAB's version 7.3: save it with -v7") from error
    except Exception as error:  # a damaged file can raise nearly anything
        raise ExportedError(f"{path} cannot be read: {_reason(error)}") from error
    return _of_arrays(path, {name: array for name, array in arrays.items() if not name.startswith("__")})


READERS: dict[str, Callable[[Path], Recording]] = {
    ".parquet": read_parquet,
    ".npz": read_npz,
    ".mat": read_mat,
}
"""Readers by the ending of a file's name."""


def with_sidecar(recording: Recording, path: Path) -> Recording:
    """Add events, info and notes from the file beside a CSV, if `tvist export` wrote one that belongs to it."""
    try:
        (note, *_) = parse_json(sidecar(path).read_bytes())["notes"]
        description = checked_description(note[KEY])
    except (OSError, ProtocolError, RecordingError, LookupError, TypeError, ValueError):
        return recording
    shapes = {
        name: (values.shape[1] if values.ndim == 2 else None) for name, values in recording.columns.items()
    }
    if shapes != {name: about.width for name, about in description.columns.items()}:
        return recording
    added = description.recording(dict(recording.columns))
    return replace(added, notes=(*added.notes, *recording.notes))


def _of_arrays(path: Path, arrays: Mapping[str, Any]) -> Recording:
    numbers = {
        name: array.astype(np.float64)
        for name, array in arrays.items()
        if array.dtype.kind in "biuf" and array.ndim in (1, 2)
    }
    if KEY not in arrays:
        flat: dict[str, Floats] = {}
        for name, array in numbers.items():
            if array.ndim == 1 or array.shape[1] == 1:
                flat[name] = array.reshape(-1)
            else:
                flat |= {f"{name}_{index}": array[:, index] for index in range(array.shape[1])}
        return _log(path, flat)
    description = _described(path, str(arrays[KEY].reshape(-1)[0]))
    columns = {}
    for name, about in description.columns.items():
        if name not in numbers:
            raise ExportedError(f"{path} has no array {name}, which its description names")
        array = numbers[name]
        columns[name] = array.reshape(-1) if about.width is None else array.reshape(len(array), about.width)
    return _recording(path, description, columns)


def _joined(parts: list[Floats], rows: int) -> Floats:
    return np.column_stack(parts) if parts else np.empty((rows, 0))


def _log(path: Path, flat: Mapping[str, Floats]) -> Recording:
    """Columns without our description, as of a log."""
    lengths = {len(values) for values in flat.values()}
    if len(lengths) != 1:
        raise ExportedError(f"{path} holds no columns of numbers of equal lengths")
    rows = np.arange(1.0, lengths.pop() + 1.0)
    return recording_of(Rows(path, list(flat), np.column_stack(list(flat.values())), rows, "row"))


def _described(path: Path, text: str) -> Description:
    try:
        return described(text)
    except RecordingError as error:
        raise ExportedError(f"{path} {error}") from error


def _recording(path: Path, description: Description, columns: dict[str, Floats]) -> Recording:
    try:
        return description.recording(columns)
    except RecordingError as error:
        raise ExportedError(f"{path}: {error}") from error


def _reason(error: Exception) -> str:
    return (
        (error.strerror if isinstance(error, OSError) else None) or str(error).strip() or type(error).__name__
    )
