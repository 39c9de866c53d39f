"""What a call of a function takes from the budget of its program."""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def costs(evaluations: int) -> Callable[[F], F]:
    """Return a decorator for a function whose calls take many times as long as an operator.

    Args:
        evaluations: What a call takes from the budget, in proportion to its time; without the decorator it takes one.
    """

    def note(function: F) -> F:
        function.__dict__["cost"] = evaluations
        return function

    return note


def cost_of(function: Callable[..., Any]) -> int:
    """Return how many evaluations a call takes from the budget."""
    return getattr(function, "cost", 1)
