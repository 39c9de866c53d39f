"""Output of the commands: tables and progress for people, one JSON object for programs."""

import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import msgspec
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from tvist_cli.failure import Failure, interrupted
from tvist_protocol.errors import HARMFUL, harmless

if TYPE_CHECKING:
    from tvist_lab.report import ReportPage

GAP = " │ "
WIDTH = 120  # number of columns when the output is not a terminal


class _Screen(Console):
    """A terminal that ignores control characters in the text it shows, which may come from anywhere."""

    def __init__(self, stream: TextIO, *, stderr: bool = False) -> None:
        width = None if stream.isatty() else WIDTH
        super().__init__(highlight=False, emoji=False, markup=False, stderr=stderr, width=width)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        for part in super().render(renderable, options):
            yield part if part.control else Segment(harmless(part.text), part.style)


out = _Screen(sys.stdout)
err = _Screen(sys.stderr, stderr=True)
"""Progress and messages, on stderr so that they do not mix with `--json`."""


def say(message: str) -> None:
    """Print a message on one line of any length, since it may go to a log or contain a path to copy."""
    try:
        err.print(message, soft_wrap=True)
    except OSError:
        # The terminal is closed. Without this, writing the rest would fail again when the process ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def program() -> str:
    """Return how to call this program from this folder: by name if the shell finds that, else by path."""
    here, found = Path(sys.executable).with_name("tvist"), shutil.which("tvist")
    if not here.exists() or (found is not None and Path(found).samefile(here)):
        return "tvist"
    folder = Path.cwd()
    return shlex.quote(str(here.relative_to(folder) if here.is_relative_to(folder) else here))


def typed() -> str:
    """Return the command line as it was typed, for pages that show how they were made."""
    return shlex.join(["tvist", *sys.argv[1:]])


def print_json(value: Any) -> None:
    """Print one JSON object and nothing else."""
    text = msgspec.json.encode(value).decode()
    print(HARMFUL.sub(lambda found: f"\\u{ord(found[0]):04x}", text))


def print_lines(value: Any, lines: Iterable[str], *, json: bool) -> None:
    """Print a result as one JSON object, or as lines for people, which may contain paths to copy."""
    if json:
        print_json(value)
        return
    for line in lines:
        out.print(line, soft_wrap=True)


@contextmanager
def waiting(what: str) -> Iterator[Callable[[str], None]]:
    """Show on a terminal what the program waits for; yield a function that changes the text."""
    if err.is_terminal:
        with err.status(Text(what)) as status:
            yield lambda now: status.update(Text(now))
    else:
        yield lambda _: None


@contextmanager
def progress(total: int, what: str, kept: str = "nothing was written") -> Iterator[Callable[..., None]]:
    """Show a progress bar on a terminal; yield a function that advances the bar and may rename it.

    `what` names the steps in the plural; `kept` tells what remains after Control+C.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    done = 0

    def advance(steps: int = 1, name: str | None = None) -> None:
        nonlocal done
        done += steps
        bar.update(task, advance=steps, description=name or what)

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        try:
            yield advance
        except KeyboardInterrupt:
            raise interrupted(f"{done} of {total} {what} were done; {kept}") from None


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], on: Console = out) -> None:
    """Print a table with text aligned left and numbers right, each cell on one line."""
    # A table wider than the screen is printed in parts, one below the other, each with the first column.
    from rich.table import Table

    on.print(Text(title, style="bold"))
    cells = [[cell.replace("\n", " ") for cell in row] for row in rows]
    for part in _parts(columns, cells):
        drawn = Table(show_edge=False, pad_edge=False)
        for number in part:
            drawn.add_column(columns[number], no_wrap=number == 0, justify="left" if number == 0 else "right")
        for row in cells:
            drawn.add_row(*(row[number] for number in part))
        on.print(drawn)
        on.print()


def _parts(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[list[int]]:
    """Distribute a table's columns over parts no wider than the screen; each begins with column 0."""
    wide = [
        max(cell_len(line) for cell in cells for line in cell.split("\n")) + len(GAP)
        for cells in zip(columns, *rows, strict=True)
    ]
    parts = [[0]]
    for number in range(1, len(columns)):
        if len(parts[-1]) > 1 and sum(wide[one] for one in (*parts[-1], number)) - len(GAP) > out.width:
            parts.append([0])
        parts[-1].append(number)
    return parts


def words(meanings: Mapping[str, str]) -> None:
    """Print words with their meanings beside them."""
    from rich.table import Table

    grid = Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(no_wrap=True)
    for word, meaning in meanings.items():
        grid.add_row(Text(word), Text(meaning))
    out.print(grid)
    out.print()


def number(value: float | None, digits: int = 3) -> str:
    """Format a number; None gives a dash."""
    return "–" if value is None else f"{value:.{digits}f}"


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write a result to a file, indented for people."""
    from tvist_lab.whole_file import write_whole

    write_whole(path, msgspec.json.format(msgspec.json.encode(result), indent=1) + b"\n")


def default_output(path: Path) -> Path:
    """Return a default path; Failure if the file exists, since only files the user named are replaced."""
    if path.exists():
        raise Failure(f"{path} exists already: choose the file with --output, which replaces what is there")
    return path


def write_report(path: Path, page: "ReportPage") -> None:
    """Write a web page completely or not at all, and print its path."""
    from tvist_lab.report import render
    from tvist_lab.whole_file import write_whole

    write_whole(path, render(page).encode(errors="replace"))  # a file name may have bytes that are no text
    say(f"the report is in {path}")
