"""Words that messages have in common."""


def counted(count: int, what: str) -> str:
    """Return a number with what it counts, in the plural unless it is one.

    Args:
        count: The number.
        what: Singular of a word with a regular plural.
    """
    return f"{count} {what}{'' if count == 1 else 's'}"


def named(error: BaseException) -> str:
    """Return an exception in one line: its type, and its message if it has one."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__
