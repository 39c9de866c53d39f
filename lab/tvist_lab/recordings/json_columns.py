"""Messages of one kind as columns; recorded ones are decoded in blocks: no object is made for each message."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import UnionType
from typing import Any, get_args, get_origin

import msgspec
import numpy as np
import polars as pl
from numpy.typing import NDArray

from tvist_lab.recordings.recording import Floats
from tvist_protocol.channels import tag
from tvist_protocol.recorded import JsonReader


@dataclass(frozen=True)
class Cells:
    """Values of one field of consecutive messages."""

    values: Floats | None
    """Shape (T,) or (T, k); None if the field was null in each message."""
    null: NDArray[np.bool_]
    """Whether the field was null, shape (T,); the row is NaN then."""


Block = dict[str, Cells]
"""Fields of consecutive messages by name."""


class _Column:
    """Values of a field that grow in place: arrays to be joined at the end would take twice the memory."""

    def __init__(self) -> None:
        self._values: Floats | None = None
        self._null = np.empty(0, np.bool_)

    def __len__(self) -> int:
        return len(self._null)

    def add(self, cells: Cells) -> None:
        """Append cells; rows that are shorter than others end with NaN."""
        first, past = len(self), len(self) + len(cells.null)
        self._null.resize(past, refcheck=False)
        self._null[first:] = cells.null
        if cells.values is not None:
            self._widen(cells.values.shape[1:], first)
        if self._values is None:
            return
        self._values.resize((past, *self._values.shape[1:]), refcheck=False)
        if cells.values is None:
            self._values[first:] = np.nan
        elif cells.values.ndim == 1:
            self._values[first:] = cells.values
        else:
            width = cells.values.shape[1]
            self._values[first:, :width] = cells.values
            self._values[first:, width:] = np.nan

    def cells(self) -> Cells:
        """Return all cells."""
        return Cells(self._values, self._null)

    def _widen(self, shape: tuple[int, ...], rows: int) -> None:
        """Make room for rows of a shape, after a number of rows."""
        before = self._values
        if before is None:
            self._values = np.full((rows, *shape), np.nan)
        elif shape and shape[0] > before.shape[1]:
            self._values = np.full((rows, *shape), np.nan)
            self._values[:, : before.shape[1]] = before


class JsonColumns:
    """Decodes messages to columns, one for each field that is a number or a list of numbers.

    Args:
        kind: Type of the messages.
    """

    def __init__(self, kind: type[msgspec.Struct]) -> None:
        self._kind = kind
        self._reader: JsonReader[Any] = JsonReader(kind)
        fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
        self._types = {
            name: found for name, field in fields.items() if (found := _type(field.type)) is not None
        }
        self._fields = {name: fields[name] for name in self._types}
        self._columns = {name: _Column() for name in self._fields}

    def __len__(self) -> int:
        """Number of messages."""
        return len(next(iter(self._columns.values())))

    def decode(self, messages: Sequence[bytes]) -> Block:
        """Decode messages, at least one.

        Raises:
            ProtocolError: One of them is not a message of this kind.
        """
        block = self._at_once(messages)
        return self._one_by_one(messages) if block is None else block

    def add(self, block: Block) -> None:
        """Append a block."""
        for name, cells in block.items():
            self._columns[name].add(cells)

    def all(self) -> Block:
        """Return all messages as one block."""
        return {name: column.cells() for name, column in self._columns.items()}

    def _at_once(self, messages: Sequence[bytes]) -> Block | None:
        """Decode messages as a table; None if only reading one by one can tell what they hold."""
        try:
            table = pl.read_ndjson(b"\n".join(messages), schema={"type": pl.String, **self._types})
        except pl.exceptions.PolarsError:
            return None
        if len(table) != len(messages) or not (table["type"] == tag(self._kind)).all():
            return None
        block = {}
        for name, field in self._fields.items():
            column = table[name]
            if column.null_count():
                if not _may_be_absent(field):
                    return None
                if field.default is not None and not field.required:
                    column = _with_default(column, field)
            block[name] = _cells_of_series(column)
        return block

    def _one_by_one(self, messages: Sequence[bytes]) -> Block:
        return block_of([self._reader.read(message) for message in messages], self._fields)


def block_of(messages: Sequence[Any], names: Iterable[str]) -> Block:
    """Return the fields of some names of messages, or of other objects that have them as attributes."""
    return {name: _cells_of_values([getattr(message, name) for message in messages]) for name in names}


def _type(annotation: Any) -> pl.DataType | type[pl.DataType] | None:
    """Type of a field in a table, such as Int64 for `int | None`; None if it holds no numbers."""
    if get_origin(annotation) is UnionType:
        (annotation,) = (choice for choice in get_args(annotation) if choice is not type(None))
    if get_origin(annotation) is list:
        return pl.List(pl.Float64) if get_args(annotation)[0] in (int, float) else None
    return _SCALARS.get(annotation) if get_origin(annotation) is None else None


_SCALARS: dict[Any, type[pl.DataType]] = {int: pl.Int64, float: pl.Float64, bool: pl.Boolean}


def _may_be_absent(field: msgspec.structs.FieldInfo) -> bool:
    return not field.required or type(None) in get_args(field.type)


def _with_default(column: pl.Series, field: msgspec.structs.FieldInfo) -> pl.Series:
    """Fill in the default of a field, which an earlier version did not write."""
    value = field.default if field.default is not msgspec.NODEFAULT else field.default_factory()
    default = pl.Series(column.name, [value], dtype=column.dtype)
    return column.zip_with(column.is_not_null(), default.new_from_index(0, len(column)))


def _cells_of_series(column: pl.Series) -> Cells:
    null = column.is_null().to_numpy()
    if null.all():
        return Cells(None, null)
    if not isinstance(column.dtype, pl.List):
        return Cells(column.cast(pl.Float64).to_numpy(writable=True), null)
    lengths = column.list.len().fill_null(0).to_numpy()
    width = int(lengths.max())
    shortest = lengths.min()
    entries = (column if shortest else column.filter(lengths > 0)).explode().to_numpy()
    entries = entries.astype(np.float64, copy=False)
    if shortest == width:
        return Cells(entries.reshape(len(column), width), null)
    values = np.full((len(column), width), np.nan)
    values[np.arange(width) < lengths[:, np.newaxis]] = entries
    return Cells(values, null)


def _cells_of_values(values: list[Any]) -> Cells:
    null = np.array([value is None for value in values])
    if null.all():
        return Cells(None, null)
    if not any(isinstance(value, list | tuple | np.ndarray) for value in values):
        return Cells(np.array([np.nan if value is None else value for value in values], np.float64), null)
    column = np.full((len(values), max(len(value) for value in values if value is not None)), np.nan)
    for row, value in zip(column, values, strict=True):
        if value is not None:
            row[: len(value)] = value
    return Cells(column, null)
