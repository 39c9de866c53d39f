"""Recordings from Parquet that `tvist log export` wrote, and Parquet and npz with columns of RTDE's names."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tvist_lab.recordings.apart import Arrays, in_words, read_apart, unpacked
from tvist_lab.recordings.description import KEY, Description, checked_description, described, sidecar
from tvist_lab.recordings.log_columns import ROBOT, Needs, Rows, recording_of
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_plant.user_file import check_is_file
from tvist_protocol.content import parse_json
from tvist_protocol.errors import ProtocolError


class ExportedError(RecordingError):
    """A file is no recording that was exported; the message names it."""


def read_exported(path: Path, needs: Needs = ROBOT) -> Recording:
    """Read a table in Parquet, or arrays that NumPy saved, by the ending of its name.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    kind = path.suffix.lower()
    try:
        arrays = read_apart(path) if kind == ".parquet" else unpacked(path)
    except Exception as error:  # a damaged file can raise nearly anything
        raise ExportedError(f"{path} cannot be read: {in_words(error)}") from error
    return _of_table(path, arrays, needs) if kind == ".parquet" else _log(path, _flat(arrays), needs)


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


def _of_table(path: Path, flat: Arrays, needs: Needs) -> Recording:
    """Columns for each entry of a vector."""
    text = flat.pop(KEY, None)
    if text is None:
        return _log(path, flat, needs)
    description = _described(path, str(text))
    columns = {}
    rows = len(next(iter(flat.values()), ()))
    for name, about in description.columns.items():
        names = [name] if about.width is None else [f"{name}_{index}" for index in range(about.width)]
        if missing := next((entry for entry in names if entry not in flat), None):
            raise ExportedError(f"{path} has no column {missing}, which its description names")
        parts = [flat[entry] for entry in names]
        columns[name] = parts[0] if about.width is None else _joined(parts, rows)
    return _recording(path, description, columns)


def _flat(arrays: Arrays) -> dict[str, Floats]:
    """Columns for each entry of the arrays of numbers."""
    flat: dict[str, Floats] = {}
    for name, array in arrays.items():
        if array.dtype.kind not in "biuf" or array.ndim not in (1, 2) or not len(array):
            continue
        numbers = array.astype(np.float64)
        if array.ndim == 1 or array.shape[1] == 1:
            flat[name] = numbers.reshape(-1)
        else:
            flat |= {f"{name}_{index}": numbers[:, index] for index in range(array.shape[1])}
    return flat


def _joined(parts: list[Floats], rows: int) -> Floats:
    return np.column_stack(parts) if parts else np.empty((rows, 0))


def _log(path: Path, flat: Mapping[str, Floats], needs: Needs) -> Recording:
    """Columns without our description, as of a log."""
    lengths = {len(values) for values in flat.values()}
    if len(lengths) != 1:
        raise ExportedError(f"{path} holds no columns of numbers of equal lengths")
    rows = np.arange(1.0, lengths.pop() + 1.0)
    return recording_of(
        Rows(path, list(flat), np.column_stack(list(flat.values())), rows, "row", needs=needs)
    )


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
