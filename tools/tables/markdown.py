"""Tables in Markdown."""

from collections.abc import Iterable, Sequence

from tvist_lab.study.columns import Column, Entry, cells, titles


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, left: int | None = None) -> str:
    """Return a table without a final newline; the first `left` columns (None: all) are left-aligned."""
    left = len(columns) if left is None else left
    rule = ["---"] * left + ["---:"] * (len(columns) - left)
    heads = [column.replace("\n", " ") for column in columns]
    return "\n".join(f"| {' | '.join(line)} |" for line in (heads, rule, *rows))


def in_markdown(entries: Iterable[Entry], columns: Sequence[Column], *, left: int = 1) -> str:
    """Return a table whose first `left` columns are text."""
    return markdown_table(titles(columns), cells(entries, columns), left=left)
