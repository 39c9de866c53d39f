"""Recordings in memory: a robot's messages as one array per column."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tvist_protocol.errors import TvistError, one_line
from tvist_protocol.stream import State

Floats = NDArray[np.float64]

STATE_COLUMNS = State.__struct_fields__
"""Fields of `state`, each of which becomes a column of the same name."""
TRUTH_PREFIX = "truth_"  # prefix for the column names of fields of `truth`
EPOCH = 1e8  # times beyond this are seconds since 1970, not a robot's uptime [s]


class RecordingError(TvistError, ValueError):
    """A recording lacks requested data, or its parts do not fit together; the message is one line."""

    def __init__(self, why: str) -> None:
        super().__init__(one_line(why))


class MissingColumnError(RecordingError):
    """A recording lacks a column."""

    def __init__(self, column: str, why: str) -> None:
        super().__init__(why)
        self.column = column


@dataclass(frozen=True)
class Recording:
    """States of one robot at increasing ticks, with the events between them.

    Ticks may be missing, since a slow reader loses states; the time of a row is `time`, never its index times
    the period.
    """

    columns: Mapping[str, Floats]
    """Values by name, shape (T,) or (T, k), in SI units; NaN if a field was null or shorter than in other
    rows. Null fields of `unshaped_*` take the target's values. Columns `truth_*` hold what a real robot
    cannot measure."""
    events: tuple[Any, ...] = ()
    """Events in the order of their ticks; each has `tick`, `kind`, `id`, `code`, `why`."""
    info: Any = None
    notes: tuple[str, ...] = ()
    """Notes on what was repaired or left out when a file was read."""
    foreign: bool = False
    """Whether another controller was recorded: columns may be missing, `actual_TCP_pose` may be that of a
    tool rotated against the flange, and the arm may follow its target late."""

    def __post_init__(self) -> None:
        if "tick" not in self.columns:
            raise RecordingError("a recording needs the column tick")
        for name, column in self.columns.items():
            if len(column) != len(self):
                raise RecordingError(f"column {name} has {len(column)} rows, column tick {len(self)}")
        if np.any(np.diff(self.columns["tick"]) <= 0):
            raise RecordingError("tick must increase from row to row")
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        object.__setattr__(self, "notes", tuple(map(one_line, self.notes)))

    def __len__(self) -> int:
        return len(self.columns["tick"])

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Floats:
        try:
            return self.columns[name]
        except KeyError:
            hint = " (was truth recorded?)" if name.startswith(TRUTH_PREFIX) else ""
            raise MissingColumnError(
                name, f"the recording has no column {name}{hint}; it has {', '.join(sorted(self.columns))}"
            ) from None

    @property
    def time(self) -> Floats:
        """Time of each row [s], shape (T,)."""
        return self["timestamp"]

    @property
    def origin(self) -> float:
        """Time that tables show as zero [s]: that of the first row if times are times of day, otherwise 0."""
        first = float(self.time[0]) if len(self.time) else 0.0
        return first if first > EPOCH else 0.0

    @property
    def joints(self) -> int:
        """Number of joints of the arm."""
        return int(self["target_q" if "target_q" in self else "actual_q"].shape[1])

    @cached_property
    def period(self) -> float:
        """Time between ticks [s]."""
        if len(self) < 2:
            raise RecordingError("a recording needs two states to have a period")
        tick, time = self["tick"], self.time
        return float((time[-1] - time[0]) / (tick[-1] - tick[0]))

    @property
    def missing_ticks(self) -> int:
        """Number of ticks without a row between the first and the last row."""
        tick = self["tick"]
        return int(tick[-1] - tick[0]) + 1 - len(self) if len(self) else 0

    def between(self, first_tick: int, last_tick: int) -> "Recording":
        """Return the rows and events in a range of ticks, including both ends."""
        first, past = np.searchsorted(self["tick"], [first_tick, last_tick + 1])
        if past <= first:
            raise RecordingError(f"no state between ticks {first_tick} and {last_tick}")
        columns = {name: column[first:past] for name, column in self.columns.items()}
        events = tuple(event for event in self.events if first_tick <= event.tick <= last_tick)
        return replace(self, columns=columns, events=events)

    def noted(self, *notes: str) -> "Recording":
        """Return the same recording with further notes."""
        return replace(self, notes=(*self.notes, *notes))

    def index(self, tick: int) -> int:
        """Return the index of the first row at or after a tick, or the length of the recording."""
        return int(np.searchsorted(self["tick"], tick))
