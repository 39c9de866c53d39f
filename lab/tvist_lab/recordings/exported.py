"""Recordings from Parquet that `tvist log export` wrote, and Parquet and npz with columns of RTDE's names."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tvist_lab.recordings.apart import Arrays, in_words, read_apart, unpacked
from tvist_lab.recordings.checks import check_names, check_recording
from tvist_lab.recordings.description import KEY, checked_description, described, sidecar
from tvist_lab.recordings.log_columns import ROBOT, Needs, Rows, recording_of
from tvist_lab.recordings.named_columns import in_si, named
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_plant.user_file import check_is_file
from tvist_protocol.content import parse_json
from tvist_protocol.errors import ProtocolError


class ExportedError(RecordingError):
    """A file is no recording that was exported; the message names it."""


def read_exported(path: Path, needs: Needs = ROBOT, names: str | None = None) -> Recording:
    """Read a table in Parquet, or arrays that NumPy saved, by the ending of its name.

    Args:
        path: The file.
        needs: What it must have.
        names: Names of its columns, as `named` reads them, unless `tvist log export` wrote it.

    Raises:
        RecordingError: The file cannot be read, or holds no recording.
    """
    try:
        arrays = unpacked(path) if path.suffix.lower() == ".npz" else read_apart(path)
    except Exception as error:  # a damaged file can raise nearly anything
        raise ExportedError(f"{path} cannot be read: {in_words(error)}") from error
    return _exported(path, arrays) if KEY in arrays else _log(path, arrays, needs, names)


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


def _exported(path: Path, arrays: Arrays) -> Recording:
    """What `tvist log export` wrote: vectors are arrays of two dimensions, or a column for each entry."""
    text, numbers = arrays[KEY].reshape(-1)[:1], _numbers(arrays)
    rows, columns = len(next(iter(numbers.values()), ())), dict[str, Floats]()
    try:
        description = described("".join(map(str, text)))
        for name, about in description.columns.items():
            shape = (rows,) if about.width is None else (rows, about.width)
            if about.width is not None and name not in numbers:
                parts = [numbers[f"{name}_{index}"] for index in range(about.width)]
                numbers[name] = np.column_stack(parts) if parts else np.empty(shape)
            columns[name] = numbers[name].reshape(shape)
        recording = description.recording(columns)
    except KeyError as error:
        raise ExportedError(f"{path} has no column {error}, which its description names") from error
    except ValueError as error:  # also of an array whose shape is not that of the description
        raise ExportedError(f"{path}: {error}") from error
    check_recording(path, recording)
    return recording


def _numbers(arrays: Arrays) -> dict[str, Floats]:
    return {
        name: array.astype(np.float64)
        for name, array in arrays.items()
        if array.dtype.kind in "biuf" and array.ndim in (1, 2) and len(array)
    }


def _log(path: Path, arrays: Arrays, needs: Needs, names: str | None) -> Recording:
    """Columns that nothing describes, as of a log."""
    flat: dict[str, Floats] = {}
    for name, array in _numbers(arrays).items():
        if array.ndim == 1 or array.shape[1] == 1:
            flat[name] = array.reshape(-1)
        else:
            flat |= {f"{name}_{index}": array[:, index] for index in range(array.shape[1])}
    if len({len(values) for values in flat.values()}) != 1:
        raise ExportedError(f"{path} holds no columns of numbers of equal lengths")
    header, values = list(flat), np.column_stack(list(flat.values()))
    check_names(path, header)
    rtde, units, notes = header, dict[str, str](), tuple[str, ...]()
    if names is not None:
        rtde, units = named(path, names, header)
        values, notes = in_si(rtde, values, units)
    return recording_of(
        Rows(path, rtde, values, np.arange(1.0, len(values) + 1.0), "row", notes, needs, header)
    )
