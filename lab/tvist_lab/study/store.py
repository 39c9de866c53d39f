"""The folder of a sweep: what it is a sweep of, the parts done so far, and at the end all rows in one file.

Each file is written under another name, and renamed when it is complete, so that every file of the folder can be read
at any time, whatever ended the program.
"""

import fcntl
import io
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgspec
import polars as pl

from tvist_lab.study.columns import Schema
from tvist_lab.study.work import FAILED
from tvist_lab.whole_file import UNFINISHED, whole_file

MANIFEST = "sweep.json"
"""What the folder is a sweep of."""
PARTS = "parts"
"""Folder of the parts of a sweep that has not ended."""
ROWS = "sweep.parquet"
"""All rows of a sweep that has ended."""


class StoreError(OSError):
    """A folder cannot hold this sweep; the message names the folder or the file."""


class Store:
    """An open folder; no other process can open it meanwhile.

    Args:
        folder: The folder, which is created if it does not exist.
        identity: What determines the rows, by name; the folder has to hold a sweep of the same, or nothing.
        schema: Types of the columns.

    Raises:
        StoreError: The folder holds another sweep or something else, is in use, or cannot be written.
    """

    def __init__(self, folder: Path, identity: dict[str, Any], schema: Schema) -> None:
        self.folder, self._schema = folder, dict(schema)
        self._parts = folder / PARTS
        manifest = folder / MANIFEST
        if not manifest.exists() and folder.is_dir() and any(folder.iterdir()):
            raise StoreError(f"{folder} exists already and holds no study: give another --output")
        try:
            self._parts.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        except OSError as error:
            raise _told(error, folder) from error
        try:
            self._take(manifest, identity)
        except BaseException:
            os.close(self._lock)
            raise

    def _take(self, manifest: Path, identity: dict[str, Any]) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise StoreError(f"another study is writing {self.folder}") from error
        if self._files():
            _check_same(self.folder, manifest, identity)
        else:
            content = msgspec.json.format(msgspec.json.encode(identity), indent=1) + b"\n"
            _write(manifest, content, self.folder)
        unfinished = f".*{UNFINISHED}"
        for forgotten in (*self.folder.glob(unfinished), *self._parts.glob(unfinished)):
            forgotten.unlink()
        self._next = 1 + max((int(part.stem) for part in self._parts.glob("*.parquet")), default=0)

    def _files(self) -> list[Path]:
        """Return the files with rows, the newest last."""
        files = [self.folder / ROWS, *sorted(self._parts.glob("*.parquet"))]
        return [file for file in files if file.exists()]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._lock)

    def rows(self) -> pl.DataFrame:
        """Return all rows that there are, each once, in the order of their positions.

        Raises:
            StoreError: A file cannot be read.
        """
        found = pl.concat([pl.DataFrame(schema=self._schema), *map(self._read, self._files())])
        return found.unique("row", keep="last", maintain_order=True).sort("row")

    def _read(self, file: Path) -> pl.DataFrame:
        try:
            return pl.read_parquet(file.read_bytes(), schema=self._schema)
        except (pl.exceptions.PolarsError, OSError) as error:
            raise StoreError(
                f"{file} cannot be read as rows of a study: remove it to run them again"
            ) from error

    def done(self, rows: int) -> set[int]:
        """Return the positions of the tasks that are done: all rows are there, and none failed.

        Args:
            rows: Number of rows of a task.
        """
        tasks = self.rows().select(task=pl.col("row") // rows, well=pl.col("status") != FAILED)
        counted = tasks.group_by("task").agg(pl.col("well").sum())
        return set(counted.filter(pl.col("well") == rows)["task"].to_list())

    def keep(self, rows: pl.DataFrame) -> None:
        """Write rows as a part.

        Raises:
            StoreError: The part cannot be written; the parts before it remain.
        """
        _write_frame(self._parts / f"{self._next:06d}.parquet", rows, self.folder)
        self._next += 1

    def finish(self) -> pl.DataFrame:
        """Write all rows to one file, remove the parts, and return the rows.

        Raises:
            StoreError: The file cannot be written; the parts remain.
        """
        found, parts = self.rows(), list(self._parts.glob("*.parquet"))
        if parts:
            _write_frame(self.folder / ROWS, found, self.folder)
            _remove(parts)
        return found


def _check_same(folder: Path, manifest: Path, identity: dict[str, Any]) -> None:
    try:
        held = msgspec.json.decode(manifest.read_bytes(), type=dict[str, Any])
    except (OSError, msgspec.DecodeError) as error:
        raise StoreError(f"{manifest} cannot be read as what a study is of: give another --output") from error
    wanted = msgspec.json.decode(msgspec.json.encode(identity))
    changed = [name for name in dict.fromkeys((*wanted, *held)) if wanted.get(name) != held.get(name)]
    if changed:
        raise StoreError(
            f"{folder} holds a study with other {', '.join(changed)}: give another --output, or remove the folder"
        )


def _write_frame(file: Path, rows: pl.DataFrame, folder: Path) -> None:
    content = io.BytesIO()
    rows.write_parquet(content)
    _write(file, content.getvalue(), folder)


def _write(file: Path, content: bytes, folder: Path) -> None:
    try:
        with whole_file(file) as stream:
            stream.write(content)
    except OSError as error:
        raise _told(error, folder) from error


def _remove(files: Iterable[Path]) -> None:
    for file in files:
        file.unlink()


def _told(error: OSError, folder: Path) -> StoreError:
    return StoreError(f"{folder} cannot be written: {error.strerror}; what was written before stays readable")
