"""What a call of a function takes from the budget of its program.

The unit is the time of an operator on two numbers, 0.15 µs where the weights were measured: there a budget of 2000
takes 0.3 ms, or 0.5 ms if all of it works on lists. The weights are times of calls in this unit, rounded up. They never
change with the machine: equal programs get equally far in a tick everywhere.
"""

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
