"""What the commands of studies share: they check numbers, work under a bar, and write and print a result."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import print_json, table, write_json, write_report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_lab.report import Page
    from tvist_lab.study.columns import Column, Entry

One = TypeVar("One")

Figures = Mapping[str, "Figure"]
"""Figures by the names of their files, without suffix."""


def check_range(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    """Refuse a number, the option `name`, that is not from `low` to `high`; `unit` follows numbers, as " %" does."""
    if not low <= value <= high:
        said = f"{value:g}" if isinstance(value, float) else f"{value}"
        most = f"{high:g}" if isinstance(high, float) else f"{high}"
        raise Failure(f"{name} is {said}{unit}: must be {low:g} to {most}{unit}", code=2)


def check_seed(seed: int, bits: int = 62) -> None:
    """Refuse a seed that is negative or has more bits."""
    if not 0 <= seed < 2**bits:
        raise Failure(f"seed is {seed}: must be at least 0 and less than 2^{bits}", code=2)


@dataclass(frozen=True, kw_only=True)
class Places:
    """The files and folders that a command writes its result to, each None if it was not asked for."""

    output: Path | None = None
    """JSON file."""
    figures: Path | None = None
    """Folder of the figures."""
    look: FigureOptions = AS_USUAL
    """How to write them."""
    report: Path | None = None
    """Web page."""

    def check(self, *others: Path | None) -> None:
        """Refuse what cannot be written, before anything is computed; `others` are further files."""
        self.look.check(self.figures, self.output, self.report, *others)

    def write(
        self,
        result: dict[str, Any],
        *,
        draw: Callable[[], Figures] | None = None,
        web_page: "Callable[[Figures], Page] | None" = None,
    ) -> None:
        """Write a result to all places; figures are drawn in the style that is set then."""
        with told(OSError):
            if self.output is not None:
                write_json(self.output, result)
            if draw is None:
                return
            if self.report is not None and web_page is not None:
                from tvist_lab.figures import house_style

                with house_style():
                    write_report(self.report, web_page(draw()))
            if self.figures is not None:
                with self.look.into(self.figures) as save:
                    write(save, draw())


def give(result: dict[str, Any], say_it: Callable[[dict[str, Any]], None], *, json: bool) -> None:
    """Print a result as one JSON object, or in words."""
    if json:
        print_json(result)
    else:
        say_it(result)


def show(title: str, entries: "Iterable[Entry]", columns: "Sequence[Column]") -> None:
    """Print a table of nested results."""
    from tvist_lab.study.columns import cells, titles

    table(title, titles(columns), cells(entries, columns))
