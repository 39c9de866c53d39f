"""Convert messages to columns; recorded ones are decoded in blocks, without an object for each message."""

from collections.abc import Iterable, Mapping, Sequence
from types import UnionType
from typing import Any, get_args, get_origin

import msgspec
import numpy as np
import polars as pl
from numpy.typing import NDArray

from tvist_lab.recordings.recording import STATE_COLUMNS, TRUTH_PREFIX, Floats, Recording, RecordingError
from tvist_protocol.channels import tag
from tvist_protocol.modes import RobotMode
from tvist_protocol.recorded import JsonReader

Block = Mapping[str, Floats]
"""Fields of consecutive messages by name, shape (T,) or (T, k); NaN for null and at the end of short rows."""

REGISTERS = "_register"  # suffix of the names of register banks
OF_OUR_LINE = ("reference", "unshaped", "estimated", "shaper", "motor_", "setpoint")
"""Prefixes of columns that are meaningless for a robot that was only watched."""
UNSHAPED = "unshaped_"  # prefix of fields that take the target's values where they are null
SCALARS: dict[Any, type[pl.DataType]] = {int: pl.Int64, float: pl.Float64, bool: pl.Boolean}
"""Types of numbers in a table."""


class JsonColumns:
    """Decodes recorded messages of one kind to columns, one per field with a number or a list of numbers."""

    def __init__(self, kind: type[msgspec.Struct]) -> None:
        self._kind = kind
        self._reader: JsonReader[Any] = JsonReader(kind)
        fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
        self._types = {name: one for name, field in fields.items() if (one := _type(field.type)) is not None}
        self._fields = {name: fields[name] for name in self._types}
        self.blocks: list[dict[str, Floats]] = []

    def __len__(self) -> int:
        return sum(len(block["tick"]) for block in self.blocks)

    def decode(self, messages: Sequence[bytes]) -> dict[str, Floats]:
        """Decode messages, at least one."""
        if (block := self._at_once(messages)) is not None:
            return block
        return block_of([self._reader.read(message) for message in messages], self._fields)

    def all(self) -> dict[str, Floats]:
        """Return all messages as one block. Call once: it releases data by column, which halves memory."""
        blocks, self.blocks = self.blocks, []
        return {name: _joined([block.pop(name) for block in blocks]) for name in self._fields}

    def _at_once(self, messages: Sequence[bytes]) -> dict[str, Floats] | None:
        """Decode messages as a table; None if they must be read one by one."""
        try:
            table = pl.read_ndjson(b"\n".join(messages), schema={"type": pl.String, **self._types})
        except pl.exceptions.PolarsError:
            return None
        if len(table) != len(messages) or not (table["type"] == tag(self._kind)).all():
            return None
        for name, field in self._fields.items():
            if table[name].null_count():
                if field.required and type(None) not in get_args(field.type):
                    return None
                if not field.required and field.default is not None:  # which an earlier version did not write
                    value = (
                        field.default if field.default is not msgspec.NODEFAULT else field.default_factory()
                    )
                    default = pl.Series(name, [value], dtype=table[name].dtype).new_from_index(0, len(table))
                    table = table.with_columns(table[name].zip_with(table[name].is_not_null(), default))
        shaped = [name for name in self._fields if name.startswith(UNSHAPED)]
        table = table.with_columns(pl.coalesce(name, _target_of(name)).alias(name) for name in shaped)
        return {name: _of_series(table[name]) for name in self._fields}


def _type(annotation: Any) -> pl.DataType | type[pl.DataType] | None:
    """Return a field's type in a table, such as Int64 for `int | None`; None if it holds no numbers."""
    if get_origin(annotation) is UnionType:
        (annotation,) = (choice for choice in get_args(annotation) if choice is not type(None))
    if get_origin(annotation) is list:
        return pl.List(pl.Float64) if get_args(annotation)[0] in (int, float) else None
    return SCALARS.get(annotation) if get_origin(annotation) is None else None


def _target_of(name: str) -> str:
    return name.replace("unshaped", "target")


def _of_series(column: pl.Series) -> Floats:
    if column.null_count() == len(column):
        return np.full(len(column), np.nan)
    if not isinstance(column.dtype, pl.List):
        return column.cast(pl.Float64).to_numpy(writable=True)
    lengths = column.list.len().fill_null(0).to_numpy()
    entries = column.filter(lengths > 0).explode().to_numpy().astype(np.float64, copy=False)
    if lengths.min() == (width := int(lengths.max())):
        return entries.reshape(len(column), width)
    values = np.full((len(column), width), np.nan)
    values[np.arange(width) < lengths[:, np.newaxis]] = entries
    return values


def block_of(messages: Sequence[Any], names: Iterable[str]) -> dict[str, Floats]:
    """Return the named fields of messages, or attributes of other objects."""
    block = {}
    for name in names:
        values = [getattr(message, name) for message in messages]
        if name.startswith(UNSHAPED):
            others = (getattr(message, _target_of(name)) for message in messages)
            values = [other if value is None else value for value, other in zip(values, others, strict=True)]
        block[name] = _of_values(values)
    return block


def _of_values(values: list[Any]) -> Floats:
    widths = [len(value) for value in values if isinstance(value, list | tuple | np.ndarray)]
    if not widths:
        return np.array([np.nan if value is None else value for value in values], np.float64)
    column = np.full((len(values), max(widths)), np.nan)
    for row, value in zip(column, values, strict=True):
        if value is not None:
            row[: len(value)] = value
    return column


def _joined(parts: list[Floats]) -> Floats:
    """Join the values of several blocks; rows shorter than others end with NaN."""
    width = max((part.shape[1] for part in parts if part.ndim == 2), default=None)
    if width is None or all(part.shape[1:] == (width,) for part in parts):
        return np.concatenate(parts)
    values, first = np.full((sum(map(len, parts)), width), np.nan), 0
    for part in parts:
        if part.ndim == 2:
            values[first : first + len(part), : part.shape[1]] = part
        first += len(part)
    return values


def recording_of_messages(
    states: Sequence[Any], events: Iterable[Any] = (), truths: Sequence[Any] = (), info: Any = None
) -> Recording:
    """Make a recording from messages in any order; see `recording_of_blocks`.

    `states` have the fields `STATE_COLUMNS` as attributes, `events` a `tick`; each numeric field of `truths`
    becomes a column `truth_<field>`, NaN at ticks without truth. Raises RecordingError if there is no state.
    """
    if not states:
        raise RecordingError("a recording needs at least one state")
    true = block_of(truths, _numeric(truths[0])) if truths else None
    return recording_of_blocks(block_of(states, STATE_COLUMNS), true, None, events, info)


def _numeric(message: Any) -> list[str]:
    """Return the names of the fields that are no text, of a msgspec struct or a plain object."""
    names = getattr(message, "__struct_fields__", None) or vars(message)
    return [name for name in names if not isinstance(getattr(message, name), str)]


def recording_of_blocks(
    states: Block, truths: Block | None, io: Block | None, events: Iterable[Any], info: Any
) -> Recording:
    """Make a recording from all messages of each kind; a repeated tick counts once, with its last message."""
    # Inputs and outputs keep their values until their next message.
    rows = _rows(states["tick"])
    columns = {name: _at(states[name], rows) for name in STATE_COLUMNS}
    if truths is not None:
        own = _rows(truths["tick"])
        found = np.minimum(np.searchsorted(truths["tick"][own], columns["tick"]), len(own) - 1)
        known = truths["tick"][own][found] == columns["tick"]
        for name, values in truths.items():
            if name not in ("tick", "timestamp"):
                columns[TRUTH_PREFIX + name] = _known(_at(values, own[found]), known)
    if io is not None:
        columns |= _held(io, columns["tick"])
    in_order = tuple(sorted(events, key=lambda event: int(event.tick)))
    if getattr(info, "watched", None) is None:
        return Recording(columns, in_order, info)
    # While disconnected, measurements repeat. Columns of our control line do not describe a watched robot.
    there = columns["robot_mode"] != RobotMode.DISCONNECTED
    kept = {name: column[there] for name, column in columns.items() if not name.startswith(OF_OUR_LINE)}
    return Recording(kept, in_order, info, foreign=True)


def _held(io: Block, ticks: Floats) -> dict[str, Floats]:
    """Return inputs and outputs at each tick, NaN before the first message; without register banks that stay 0."""
    # The force at the tool is left out: it is measured once a second and does not hold until the next
    # message.
    rows = _rows(io["tick"])
    place = np.searchsorted(io["tick"][rows], ticks, side="right") - 1
    return {
        name: _known(_at(values, rows[np.maximum(place, 0)]), place >= 0)
        for name, values in io.items()
        if name not in ("tick", "actual_TCP_force") and (not name.endswith(REGISTERS) or np.any(values))
    }


def _rows(ticks: Floats) -> NDArray[np.intp]:
    """Return the index of each tick's last message, by increasing tick."""
    order = np.argsort(ticks, kind="stable")
    last: NDArray[np.bool_] = np.append(np.diff(ticks[order]) != 0.0, [True])
    return order[last]


def _at(values: Floats, rows: NDArray[np.intp]) -> Floats:
    every = len(rows) == len(values) and rows[0] == 0 and bool(np.all(np.diff(rows) == 1))
    return values if every else values[rows]


def _known(values: Floats, known: NDArray[np.bool_]) -> Floats:
    if known.all():
        return values
    values = values.copy()
    values[~known] = np.nan
    return values
