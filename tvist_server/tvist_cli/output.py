"""What commands print: tables and progress for people on stderr and stdout, one JSON object for machines."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import msgspec
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

out = Console(highlight=False)
"""Results."""
err = Console(stderr=True, highlight=False)
"""Progress and messages: nothing of it mixes with `--json`."""


def print_json(value: Any) -> None:
    """One JSON object and nothing else."""
    print(msgspec.json.encode(value).decode())


@contextmanager
def progress(total: int, what: str) -> Iterator[Progress]:
    """A bar on stderr with one task, number 0."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True) as bar:
        bar.add_task(what, total=total)
        yield bar


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table: text to the left, numbers to the right."""
    drawn = Table(title=title, title_justify="left", title_style="bold", show_edge=False, pad_edge=False)
    for number, column in enumerate(columns):
        drawn.add_column(column, justify="left" if number == 0 else "right")
    for row in rows:
        drawn.add_row(*row)
    out.print(drawn)
    out.print()


def number(value: float | None, digits: int = 3) -> str:
    """A figure, or a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"
