"""Write recordings as CSV and Parquet, in full precision."""

import io
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import IO

import msgspec
import numpy as np
import polars as pl

from tvist_lab.recordings.description import KEY, describe, flat_names, meaning_of, ordered, sidecar, width_of
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_lab.whole_file import whole_file

FOXGLOVE = "foxglove"  # format of `tvist_lab.foxglove`, only for recordings of a robot
EXACT = 2.0**53  # whole numbers below this are exact as integer and as float

_SYSTEM = re.compile(r"IO error: (.*) \(os error")


class ExportError(RecordingError):
    """A recording cannot be exported; the message names the file."""


def written_by(path: Path, kind: str) -> list[Path]:
    """Return the files that an export to `path` writes; Foxglove's format includes a layout."""
    if kind == FOXGLOVE:
        return [path, path.with_name(f"{path.name.removesuffix('.mcap')}-layout.json")]
    return [path, sidecar(path)] if kind == "csv" else [path]


def export(recording: Recording, path: Path, kind: str) -> None:
    """Write a recording to a file and replace it if it exists; raise ExportError if that fails.

    Scalars keep their names; vectors become columns NAME_0, NAME_1, …, like those of UR's record.py. `timestamp` comes
    first. Units, events and info are JSON, in the metadata of Parquet or in a file beside a CSV.
    """
    try:
        with whole_file(path) as stream:
            FORMATS[kind](recording, stream)
        if kind == "csv":
            with whole_file(sidecar(path)) as stream:
                stream.write(_csv_on_the_web(recording, path))
    except (OSError, pl.exceptions.PolarsError) as error:
        raise ExportError(f"{path} cannot be written: {_reason(error)}") from error


def flat(recording: Recording) -> pl.DataFrame:
    """Return one column NAME_i per entry of a vector; whole numbers become integers, NaN becomes null."""
    columns: list[pl.Series] = []
    for name, values in ordered(recording).items():
        whole = meaning_of(name).whole and _exact(values)
        for flat_name, entries in zip(
            flat_names(name, width_of(values)), np.atleast_2d(values.T), strict=True
        ):
            column = pl.Series(flat_name, np.ascontiguousarray(entries))
            columns.append(column.fill_nan(None).cast(pl.Int64) if whole else column)
    return pl.DataFrame(columns)


def _exact(values: Floats) -> bool:
    """Whether all values can be stored as integers; -0.0 cannot."""
    known = values[~np.isnan(values)]
    return bool(
        np.all((known == np.trunc(known)) & (np.abs(known) < EXACT) & ~((known == 0.0) & np.signbit(known)))
    )


def _write_parquet(recording: Recording, stream: IO[bytes]) -> None:
    table = io.BytesIO()  # if a stream fails, the error of polars would not say why
    flat(recording).write_parquet(table, metadata={KEY: describe(recording).decode()})
    stream.write(table.getbuffer())


def _csv_on_the_web(recording: Recording, path: Path) -> bytes:
    """Describe a CSV as in the W3C's "CSV on the Web"; further content is a note."""
    columns = []
    for name, values in ordered(recording).items():
        found, flat_name = meaning_of(name), flat_names(name, width_of(values))
        columns += [
            {
                "name": one,
                "datatype": "integer" if found.whole and _exact(values) else "double",
                "schema:unitText": found.units[index * len(found.units) // len(flat_name)]
                if found.units
                else "",
                "dc:description": found.meaning,
            }
            for index, one in enumerate(flat_name)
        ]
    content = {
        "@context": "http://www.w3.org/ns/csvw",
        "url": path.name,
        "tableSchema": {"columns": columns},
        "notes": [{KEY: msgspec.json.decode(describe(recording))}],
    }
    return json.dumps(content, indent=1, ensure_ascii=False).encode()


def _reason(error: Exception) -> str:
    found = _SYSTEM.search(str(error))
    return getattr(error, "strerror", None) or (found[1] if found else str(error))


def _write_csv(recording: Recording, to: IO[bytes]) -> None:
    flat(recording).with_columns(pl.col(pl.Float64).fill_nan(None)).write_csv(to)


FORMATS: dict[str, Callable[[Recording, IO[bytes]], None]] = {"csv": _write_csv, "parquet": _write_parquet}
"""Function that writes each format; a file's ending is the format's name."""
