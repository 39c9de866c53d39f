"""Phrases shared by messages."""

from collections.abc import Sequence
from statistics import median

QUANTILES_FROM = 20  # number of values from which quantiles are meaningful; with fewer, extremes are shown


def counted(count: int, what: str) -> str:
    """Return a number with what it counts; `what` is a singular with regular plural."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def sample(count: int, what: str) -> str:
    """Return what a figure of `spread` or `either` is based on: a few things, or the median of many."""
    return f"{'median of ' if count >= QUANTILES_FROM else ''}{counted(count, what)}"


def spread(values: Sequence[float], unit: str, digits: int = 0) -> str:
    """Format values with a unit: from smallest to largest if few, the median if many; at least one."""
    ends = [median(values)] if len(values) >= QUANTILES_FROM else [min(values), max(values)]
    return " to ".join(dict.fromkeys(f"{end:.{digits}f} {unit}" for end in ends))


def either(values: Sequence[float], unit: str, words: tuple[str, str]) -> str:
    """Format values, at least one, with words for their sign: "94 % to 95 % less", "from 3 % more to 20 % less"."""
    low, high = (median(values),) * 2 if len(values) >= QUANTILES_FROM else (min(values), max(values))
    less, more = words
    if round(low) < 0 < round(high):
        return f"from {-low:.0f} {unit} {more} to {high:.0f} {unit} {less}"
    return f"{spread([abs(low), abs(high)], unit)} {less if low + high >= 0.0 else more}"
