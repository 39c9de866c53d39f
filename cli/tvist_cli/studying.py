"""Functions shared by commands with studies: check numbers, show progress, write and print results."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from tvist_cli.failure import Failure, failing_on
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions, write
from tvist_cli.output import print_json, table, write_json, write_report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_lab.report import ReportPage
    from tvist_lab.study.columns import Column, Entry

One = TypeVar("One")

Figures = Mapping[str, "Figure"]  # figures by file name, without suffix


def check_range(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    """Refuse an option's value that is not from `low` to `high`; `unit` follows numbers in the message, like " %"."""
    if not low <= value <= high:
        said = f"{value:g}" if isinstance(value, float) else f"{value}"
        most = f"{high:g}" if isinstance(high, float) else f"{high}"
        raise Failure(f"{name} is {said}{unit}: must be {low:g} to {most}{unit}", code=2)


def check_seed(seed: int, bits: int = 62) -> None:
    """Refuse a seed that is negative or has more bits."""
    if not 0 <= seed < 2**bits:
        raise Failure(f"seed is {seed}: must be at least 0 and less than 2^{bits}", code=2)


@dataclass(frozen=True, kw_only=True)
class ResultFiles:
    """Files and folders for a command's result, each None if not requested."""

    output: Path | None = None
    figures: Path | None = None
    look: FigureOptions = DEFAULT_FIGURES
    report: Path | None = None

    def check(self, *others: Path | None) -> None:
        """Refuse files that cannot be written, before anything is computed; `others` are further files."""
        self.look.check(self.figures, self.output, self.report, *others)

    def write(
        self,
        result: dict[str, Any],
        *,
        draw: Callable[[], Figures] | None = None,
        web_page: "Callable[[Figures], ReportPage] | None" = None,
    ) -> None:
        """Write a result to all places; figures are drawn in the present style."""
        with failing_on(OSError):
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
    """Print a result as one JSON object or as text."""
    if json:
        print_json(result)
    else:
        say_it(result)


def show(title: str, entries: "Iterable[Entry]", columns: "Sequence[Column]") -> None:
    """Print a table of nested results."""
    from tvist_lab.study.columns import cells, titles

    table(title, titles(columns), cells(entries, columns))
