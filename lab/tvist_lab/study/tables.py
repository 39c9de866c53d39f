"""Tables of figures: what to show of nested results, in which digits, for a terminal or a web page alike."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Entry = Mapping[str, Any]


@dataclass(frozen=True)
class Shown:
    """A column of a table."""

    title: str
    of: str | Callable[[Entry], Any]
    """Where its value is in an entry, such as "delay_ms.median", or what finds it."""
    digits: int | None = None
    """Number of decimals; None for text."""
    unit: str = ""
    """What follows the number."""

    def text(self, entry: Entry) -> str:
        """Return a cell; a dash stands for what was not measurable."""
        if callable(self.of):
            value = self.of(entry)
        else:
            value = entry
            for key in self.of.split("."):
                value = value[key]
        if value is None:
            return "–"
        return str(value) if self.digits is None else f"{value:.{self.digits}f}{self.unit}"


def titles(columns: Iterable[Shown]) -> tuple[str, ...]:
    """Return the headings of columns."""
    return tuple(column.title for column in columns)


def cells(entries: Iterable[Entry], columns: Sequence[Shown]) -> list[tuple[str, ...]]:
    """Return the cells of a table, a row for each entry."""
    return [tuple(column.text(entry) for column in columns) for entry in entries]
