"""Columns of a recording from messages, decoded in blocks or one by one."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tvist_lab.recordings.json_columns import Block, Cells, block_of
from tvist_lab.recordings.recording import STATE_COLUMNS, TRUTH_PREFIX, Floats, Recording, RecordingError
from tvist_protocol.modes import RobotMode

REGISTERS = "_register"
"""End of the names of banks of registers."""
OF_OUR_LINE = ("reference", "unshaped", "estimated", "shaper", "motor_", "setpoint")
"""Beginnings of the names of columns that say nothing of a robot that was only watched."""
UNSHAPED = "unshaped_"
"""Prefix of columns that have the target's values where they are null."""


def recording_of_messages(
    states: Sequence[Any], events: Iterable[Any] = (), truths: Sequence[Any] = (), info: Any = None
) -> Recording:
    """Make a recording of messages, in any order; see `recording_of_blocks`.

    A tick without truth has NaN in the truth columns.

    Args:
        states: Objects with the fields of `STATE_COLUMNS` as attributes.
        events: Objects with the attribute `tick`.
        truths: Objects with `tick` and other fields as attributes; each field becomes a column `truth_<field>`.
        info: Stored unchanged.

    Raises:
        RecordingError: There is no state.
    """
    if not states:
        raise RecordingError("a recording needs at least one state")
    true = block_of(truths, _numeric(truths[0])) if truths else None
    return recording_of_blocks(block_of(states, STATE_COLUMNS), true, None, events, info)


def _numeric(message: Any) -> list[str]:
    """Names of a message's fields that are no text, from a msgspec struct or a plain object."""
    names = getattr(message, "__struct_fields__", None) or vars(message)
    return [name for name in names if not isinstance(getattr(message, name), str)]


def recording_of_blocks(
    states: Block, truths: Block | None, io: Block | None, events: Iterable[Any], info: Any
) -> Recording:
    """Make a recording; a repeated tick counts once, with its last message.

    Args:
        states: Fields of all states, at least one.
        truths: Fields of all truths, if there are any.
        io: Fields of all messages about inputs and outputs, if there are any. Their values hold until the next one.
        events: Events.
        info: Stored unchanged.
    """
    rows = _rows(states["tick"])
    columns = {}
    for name in STATE_COLUMNS:
        cells = states[name]
        if name.startswith(UNSHAPED):
            cells = _or_else(cells, states[name.replace("unshaped", "target")])
        columns[name] = _at(cells, rows)
    if truths is not None:
        places, known = _places(truths["tick"], columns["tick"])
        for name, cells in truths.items():
            if name not in ("tick", "timestamp"):
                columns[TRUTH_PREFIX + name] = _known(_at(cells, places), known)
    if io is not None:
        columns |= _held(io, columns["tick"])
    in_order = tuple(sorted(events, key=lambda event: int(event.tick)))
    if getattr(info, "watched", None) is None:
        return Recording(columns, in_order, info)
    # A lost connection repeats the last measurements, and what our line would do is nothing that the robot did.
    there = columns["robot_mode"] != RobotMode.DISCONNECTED
    kept = {name: column[there] for name, column in columns.items() if not name.startswith(OF_OUR_LINE)}
    return Recording(kept, in_order, info, foreign=True)


def _held(io: Block, ticks: Floats) -> dict[str, Floats]:
    """Values of inputs and outputs at each tick, NaN before the first message; without banks of registers that stay 0.

    The force at the tool is left out: it is measured once a second and does not hold until the next message.
    """
    rows = _rows(io["tick"])
    assert io["tick"].values is not None
    place = np.searchsorted(io["tick"].values[rows], ticks, side="right") - 1
    known = place >= 0
    columns = {}
    for name, cells in io.items():
        unused = name.endswith(REGISTERS) and cells.values is not None and not np.any(cells.values)
        if name not in ("tick", "actual_TCP_force") and not unused:
            columns[name] = _known(_at(cells, rows[np.maximum(place, 0)]), known)
    return columns


def _rows(tick: Cells) -> NDArray[np.intp]:
    """Indices of the last message of each tick, by increasing tick."""
    assert tick.values is not None
    order = np.argsort(tick.values, kind="stable")
    ticks = tick.values[order]
    last: NDArray[np.bool_] = np.append(ticks[1:] != ticks[:-1], [True])
    return order[last]


def _places(tick: Cells, ticks: Floats) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Index of the message of each tick, and whether there is one."""
    assert tick.values is not None
    rows = _rows(tick)
    found = np.minimum(np.searchsorted(tick.values[rows], ticks), len(rows) - 1)
    return rows[found], tick.values[rows[found]] == ticks


def _at(cells: Cells, rows: NDArray[np.intp]) -> Floats:
    if cells.values is None:
        return np.full(len(rows), np.nan)
    if len(rows) == len(cells.values) and rows[0] == 0 and bool(np.all(np.diff(rows) == 1)):
        return cells.values
    return cells.values[rows]


def _known(values: Floats, known: NDArray[np.bool_]) -> Floats:
    if known.all():
        return values
    values = values.copy()
    values[~known] = np.nan
    return values


def _or_else(cells: Cells, other: Cells) -> Cells:
    """Values of a field, or where they are null those of another."""
    if cells.values is None or other.values is None or not cells.null.any():
        return cells if other.values is None or cells.values is not None else other
    width = max(cells.values.shape[1], other.values.shape[1])
    values = np.full((len(cells.null), width), np.nan)
    values[:, : cells.values.shape[1]] = cells.values
    values[cells.null] = np.nan
    values[cells.null, : other.values.shape[1]] = other.values[cells.null]
    return Cells(values, cells.null & other.null)
