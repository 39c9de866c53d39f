"""Tables in Markdown."""

from collections.abc import Sequence


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, left: int | None = None) -> str:
    """Return a table in Markdown, without a line's end behind it.

    Args:
        columns: Headings.
        rows: Cells of each row.
        left: Number of columns, from the first on, that are aligned to the left; the others are to the right. None:
            all are to the left.
    """
    left = len(columns) if left is None else left
    rule = ["---"] * left + ["---:"] * (len(columns) - left)
    return "\n".join(f"| {' | '.join(line)} |" for line in (columns, rule, *rows))
