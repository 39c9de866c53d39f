"""Costs of function calls, which are taken from a program's budget.

The unit is the time of an operator on two numbers, 0.15 µs where the weights were measured: a budget of 2000
takes 0.3 ms there, or 0.5 ms if all of it works on lists. Costs are times of calls in this unit, rounded up.
They are the same on every machine, so a program gets equally far in a tick everywhere.
"""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def costs(evaluations: int) -> Callable[[F], F]:
    """Return a decorator for a function whose call takes many times as long as an operator.

    Args:
        evaluations: Cost of a call, in proportion to its time; without the decorator it is 1.
    """

    def note(function: F) -> F:
        function.__dict__["cost"] = evaluations
        return function

    return note
