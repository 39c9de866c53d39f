"""Words that messages have in common."""


def counted(count: int, what: str) -> str:
    """Return a number with what it counts, in the plural unless it is one.

    Args:
        count: The number.
        what: Singular of a word with a regular plural.
    """
    return f"{count} {what}{'' if count == 1 else 's'}"
