"""The folder of a study; each file is renamed when complete, so that all can be read even after a crash."""

import fcntl
import io
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgspec
import polars as pl

from tvist_lab.study.work import FAILED
from tvist_lab.whole_file import UNFINISHED, whole_file

MANIFEST = "study.json"  # file with the study's identity, which determines the rows
PARTS = "parts"  # folder for the parts of an unfinished study
ROWS = "rows.parquet"


class StoreError(OSError):
    """A folder cannot hold this study; the message names the folder or the file."""


class Store:
    """An open folder, locked against other processes."""

    def __init__(self, folder: Path, identity: dict[str, Any], schema: dict[str, Any]) -> None:
        self.folder, self._schema = folder, schema
        self._parts = folder / PARTS
        manifest = folder / MANIFEST
        if not manifest.exists() and folder.is_dir() and any(folder.iterdir()):
            raise StoreError(f"{folder} exists and is no folder of a study: give another --output")
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
            raise StoreError(f"{self.folder} is in use by another study: give another --output") from error
        if self._files():
            _check_same(self.folder, manifest, identity)
        else:
            self._write(manifest, msgspec.json.format(msgspec.json.encode(identity), indent=1) + b"\n")
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

    def _write(self, file: Path, content: bytes) -> None:
        try:
            with whole_file(file) as stream:
                stream.write(content)
        except OSError as error:
            raise _told(error, self.folder) from error

    def _write_rows(self, file: Path, rows: pl.DataFrame) -> None:
        content = io.BytesIO()
        rows.write_parquet(content)
        self._write(file, content.getvalue())

    def rows(self) -> pl.DataFrame:
        """Return all available rows, each once, in the order of their cases."""
        found = pl.concat([pl.DataFrame(schema=self._schema), *map(self._read, self._files())])
        found = found.unique(["case", "shaper", "arm"], keep="last", maintain_order=True)
        return found.sort("case", maintain_order=True)

    def _read(self, file: Path) -> pl.DataFrame:
        try:
            return pl.read_parquet(file.read_bytes(), schema=self._schema)
        except (pl.exceptions.PolarsError, OSError) as error:
            raise StoreError(f"{file} has no rows of a study: remove it to run them again") from error

    def done(self) -> set[int]:
        """Return the cases that are done: all their rows exist and none failed."""
        found = self.rows().group_by("case").agg(well=(pl.col("status") != FAILED).all())
        return set(found.filter("well")["case"].to_list())

    def keep(self, rows: pl.DataFrame) -> None:
        """Write rows as a part."""
        self._write_rows(self._parts / f"{self._next:06d}.parquet", rows)
        self._next += 1

    def finish(self) -> pl.DataFrame:
        """Write all rows to one file, remove the parts, and return the rows."""
        found, parts = self.rows(), list(self._parts.glob("*.parquet"))
        if parts:
            self._write_rows(self.folder / ROWS, found)
            for part in parts:
                part.unlink()
        return found


def _check_same(folder: Path, manifest: Path, identity: dict[str, Any]) -> None:
    try:
        held = msgspec.json.decode(manifest.read_bytes(), type=dict[str, Any])
    except (OSError, msgspec.DecodeError) as error:
        raise StoreError(f"{manifest} does not describe a study: give another --output") from error
    wanted = msgspec.json.decode(msgspec.json.encode(identity))
    changed = [name for name in dict.fromkeys((*wanted, *held)) if wanted.get(name) != held.get(name)]
    if changed:
        raise StoreError(
            f"{folder} holds a study with other {', '.join(changed)}: give another --output, or remove the folder"
        )


def _told(error: OSError, folder: Path) -> StoreError:
    return StoreError(f"{folder} cannot be written: {error.strerror}; what was written before stays readable")
