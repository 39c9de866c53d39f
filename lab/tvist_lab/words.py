"""Words that messages have in common."""

from collections.abc import Sequence
from statistics import median

MANY = 20
"""Number of values from which on a median and other quantiles say something; of fewer, the smallest and largest."""


def counted(count: int, what: str) -> str:
    """Return a number with what it counts, in the plural unless it is one.

    Args:
        count: The number.
        what: Singular of a word with a regular plural.
    """
    return f"{count} {what}{'' if count == 1 else 's'}"


def sample(count: int, what: str) -> str:
    """Return what a figure by `spread` or `either` is of: some things, or the median of many."""
    return f"{'median of ' if count >= MANY else ''}{counted(count, what)}"


def spread(values: Sequence[float], unit: str, digits: int = 0) -> str:
    """Return values in words: from the smallest to the largest of few, the median of many.

    Args:
        values: At least one value.
        unit: Their unit, which follows every number.
        digits: Number of decimals.
    """
    ends = [median(values)] if len(values) >= MANY else [min(values), max(values)]
    return " to ".join(dict.fromkeys(f"{end:.{digits}f} {unit}" for end in ends))


def either(values: Sequence[float], unit: str, words: tuple[str, str]) -> str:
    """Return values in words that say their sign: "94 % to 95 % less", "from 3 % more to 20 % less".

    Args:
        values: At least one value.
        unit: Their unit.
        words: What follows a positive one, and a negative one.
    """
    low, high = (median(values),) * 2 if len(values) >= MANY else (min(values), max(values))
    less, more = words
    if round(low) < 0 < round(high):
        return f"from {-low:.0f} {unit} {more} to {high:.0f} {unit} {less}"
    return f"{spread([abs(low), abs(high)], unit)} {less if low + high >= 0.0 else more}"
