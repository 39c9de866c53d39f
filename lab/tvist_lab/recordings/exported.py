"""Recordings from Parquet, npz and mat: those of `tvist log export`, and others with columns of RTDE's names."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tvist_lab.recordings.apart import Arrays, in_words, read_apart, unpacked
from tvist_lab.recordings.checks import check_names, check_recording
from tvist_lab.recordings.description import KEY, Description, checked_description, described, sidecar
from tvist_lab.recordings.log_columns import ROBOT, Needs, Rows, recording_of
from tvist_lab.recordings.named_columns import in_si, named
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_plant.user_file import check_is_file
from tvist_protocol.content import parse_json
from tvist_protocol.errors import ProtocolError


class ExportedError(RecordingError):
    """A file is no recording that was exported; the message names it."""


def read_exported(path: Path, needs: Needs = ROBOT, names: str | None = None) -> Recording:
    """Read a table in Parquet, arrays that NumPy saved, or a MAT-file of version 4 to 7, by the ending of its name.

    Args:
        path: The file.
        needs: What it must have.
        names: Names of its columns, as `named` reads them, unless `tvist log export` wrote it.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    kind = path.suffix.lower()
    try:
        arrays = unpacked(path) if kind == ".npz" else read_apart(path)
    except Exception as error:  # a damaged file can raise nearly anything
        raise ExportedError(f"{path} cannot be read: {in_words(error)}") from error
    if KEY not in arrays:
        return _log(path, arrays, needs, names)
    return _of_table(path, arrays) if kind == ".parquet" else _of_arrays(path, arrays)


def with_sidecar(recording: Recording, path: Path) -> Recording:
    """Add events, info and notes from the file beside a CSV, if `tvist log export` wrote one that belongs to it."""
    try:
        check_is_file(sidecar(path), "description")
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


def _of_table(path: Path, flat: Arrays) -> Recording:
    """Columns for each entry of a vector."""
    description = _described(path, str(flat.pop(KEY)))
    columns = {}
    rows = len(next(iter(flat.values()), ()))
    for name, about in description.columns.items():
        names = [name] if about.width is None else [f"{name}_{index}" for index in range(about.width)]
        if missing := next((entry for entry in names if entry not in flat), None):
            raise ExportedError(f"{path} has no column {missing}, which its description names")
        parts = [flat[entry] for entry in names]
        columns[name] = parts[0] if about.width is None else _joined(parts, rows)
    return _recording(path, description, columns)


def _numbers(arrays: Mapping[str, Any]) -> dict[str, Floats]:
    return {
        name: array.astype(np.float64)
        for name, array in arrays.items()
        if array.dtype.kind in "biuf" and array.ndim in (1, 2) and len(array)
    }


def _of_arrays(path: Path, arrays: Mapping[str, Any]) -> Recording:
    numbers = _numbers(arrays)
    description = _described(path, "".join(map(str, arrays[KEY].reshape(-1)[:1])))
    columns = {}
    for name, about in description.columns.items():
        if name not in numbers:
            raise ExportedError(f"{path} has no array {name}, which its description names")
        array = numbers[name]
        if array.size != len(array) * (1 if about.width is None else about.width):
            raise ExportedError(
                f"{path}: array {name} has the shape {array.shape}, not the one of its description"
            )
        columns[name] = array.reshape(-1) if about.width is None else array.reshape(len(array), about.width)
    return _recording(path, description, columns)


def _joined(parts: list[Floats], rows: int) -> Floats:
    return np.column_stack(parts) if parts else np.empty((rows, 0))


def _log(path: Path, arrays: Arrays, needs: Needs, names: str | None) -> Recording:
    """Columns that nothing describes, as of a log."""
    flat: dict[str, Floats] = {}
    for name, array in _numbers(arrays).items():
        if array.ndim == 1 or array.shape[1] == 1:
            flat[name] = array.reshape(-1)
        else:
            flat |= {f"{name}_{index}": array[:, index] for index in range(array.shape[1])}
    lengths = {len(values) for values in flat.values()}
    if len(lengths) != 1:
        raise ExportedError(f"{path} holds no columns of numbers of equal lengths")
    rows, header, values = (
        np.arange(1.0, lengths.pop() + 1.0),
        list(flat),
        np.column_stack(list(flat.values())),
    )
    check_names(path, header)
    rtde, units = (header, {}) if names is None else named(path, names, header)
    values, notes = (values, ()) if names is None else in_si(rtde, values, units)
    return recording_of(Rows(path, rtde, values, rows, "row", notes, needs, header))


def _described(path: Path, text: str) -> Description:
    try:
        return described(text)
    except RecordingError as error:
        raise ExportedError(f"{path} {error}") from error


def _recording(path: Path, description: Description, columns: dict[str, Floats]) -> Recording:
    try:
        recording = description.recording(columns)
    except RecordingError as error:
        raise ExportedError(f"{path}: {error}") from error
    check_recording(path, recording)
    return recording
