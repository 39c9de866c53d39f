"""Functions shared by commands that run studies: they check seeds and print results."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Misuse
from tvist_cli.output import print_json, table

if TYPE_CHECKING:
    from tvist_lab.study.columns import Column, Entry


def check_seed(seed: int) -> None:
    """Refuse a seed that is negative or has more than 62 bits."""
    if not 0 <= seed < 2**62:
        raise Misuse(f"seed is {seed}: must be at least 0 and less than 2^62")


def print_result(result: dict[str, Any], say_it: Callable[[], None], *, json: bool) -> None:
    """Print a result as one JSON object or as text."""
    if json:
        print_json(result)
    else:
        say_it()


def print_entries(title: str, entries: "Iterable[Entry]", columns: "Sequence[Column]") -> None:
    """Print a table of nested results."""
    from tvist_lab.study.columns import cells, titles

    table(title, titles(columns), cells(entries, columns))
