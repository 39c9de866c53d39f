"""What commands print: tables and progress for people on stderr and stdout, one JSON object for machines."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import msgspec
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from tvist_cli.failure import interrupted

WIDTH = 120
"""Columns where there is no terminal to ask."""
out = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)
"""Results."""
err = Console(stderr=True, highlight=False, width=None if sys.stderr.isatty() else WIDTH)
"""Progress and messages: nothing of it mixes with `--json`."""


def say(message: str) -> None:
    """A message for a person, in one line however long: it may stand in a log, or hold a path to be copied."""
    try:
        err.print(message, soft_wrap=True, markup=False)
    except OSError:
        # The terminal is gone, with whoever would have read it; what was not written would fail again at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def print_json(value: Any) -> None:
    """One JSON object and nothing else."""
    print(msgspec.json.encode(value).decode())


@contextmanager
def progress(
    total: int, what: str, kept: str = "nothing was written"
) -> Iterator[Callable[[int, str | None], None]]:
    """A bar on stderr, where that is a terminal; the function given advances it and may rename what is done.

    Args:
        total: How many there are.
        what: Of what, in the plural.
        kept: What is left of it at Control+C.

    Raises:
        Failure: Control+C came; the sentence says how far it was.
    """
    done = 0

    def advance(steps: int, name: str | None) -> None:
        nonlocal done
        done += steps
        bar.update(task, advance=steps, description=name or what)

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        try:
            yield advance
        except KeyboardInterrupt:
            raise interrupted(f"{done} of {total} {what} were done; {kept}") from None


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table: text to the left, numbers to the right."""
    drawn = Table(title=title, title_justify="left", title_style="bold", show_edge=False, pad_edge=False)
    for number, column in enumerate(columns):
        drawn.add_column(column, no_wrap=number == 0, justify="left" if number == 0 else "right")
    for row in rows:
        drawn.add_row(*row)
    out.print(drawn)
    out.print()


def number(value: float | None, digits: int = 3) -> str:
    """A figure, or a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"
