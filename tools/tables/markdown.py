"""Tables in Markdown."""

from collections.abc import Iterable, Sequence

from tvist_lab.study.tables import Entry, Shown, cells, titles


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, left: int | None = None) -> str:
    """Return a table, without a line's end behind it, whose first `left` columns are aligned to the left; None: all."""
    left = len(columns) if left is None else left
    rule = ["---"] * left + ["---:"] * (len(columns) - left)
    return "\n".join(f"| {' | '.join(line)} |" for line in (columns, rule, *rows))


def in_markdown(entries: Iterable[Entry], columns: Sequence[Shown], *, left: int = 1) -> str:
    """Return a table, of which the first columns are text."""
    return markdown_table(titles(columns), cells(entries, columns), left=left)


def best_in_bold(
    entries: Iterable[Entry], key: str, names: Sequence[str], path: tuple[str, str], digits: int
) -> str:
    """Return a table with a column for each name, and the best value of each in bold."""
    values = {row["name"]: [row[key][name][path[0]][path[1]] for name in names] for row in entries}
    best = [
        min((column[place] for column in values.values() if column[place] is not None), default=None)
        for place in range(len(names))
    ]

    def cell(value: float | None, place: int) -> str:
        said = "–" if value is None else f"{value:.{digits}f}"
        return f"**{said}**" if value is not None and value == best[place] else said

    rows = [
        (name, *(cell(value, place) for place, value in enumerate(column))) for name, column in values.items()
    ]
    return markdown_table(("shaper", *names), rows, left=1)
