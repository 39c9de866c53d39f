"""Functions shared by commands with studies: check numbers, show progress, write and print results."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Misuse, failing_on
from tvist_cli.figure_files import FigureOptions, write
from tvist_cli.output import print_json, table, write_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_lab.study.columns import Column, Entry

Figures = Mapping[str, "Figure"]  # figures by file name, without suffix


def check_seed(seed: int) -> None:
    """Refuse a seed that is negative or has more than 62 bits."""
    if not 0 <= seed < 2**62:
        raise Misuse(f"seed is {seed}: must be at least 0 and less than 2^62")


@dataclass(frozen=True)
class ResultFiles:
    """Files and folders for a command's result, each None if not requested."""

    output: Path | None
    figures: Path | None
    look: FigureOptions

    def write(self, result: dict[str, Any], draw: Callable[[], Figures]) -> None:
        """Write a result to all places."""
        with failing_on(OSError):
            if self.output is not None:
                write_json(self.output, result)
            if self.figures is not None:
                with self.look.into(self.figures) as save:
                    write(save, draw())


def print_result(result: dict[str, Any], say_it: Callable[[dict[str, Any]], None], *, json: bool) -> None:
    """Print a result as one JSON object or as text."""
    if json:
        print_json(result)
    else:
        say_it(result)


def print_entries(title: str, entries: "Iterable[Entry]", columns: "Sequence[Column]") -> None:
    """Print a table of nested results."""
    from tvist_lab.study.columns import cells, titles

    table(title, titles(columns), cells(entries, columns))
