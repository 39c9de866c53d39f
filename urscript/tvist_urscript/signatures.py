"""Signatures of functions for the compiler: parameters, whether they block, cost."""

import inspect
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any, get_origin

from tvist_urscript.values import Value

REQUIRED: Any = inspect.Parameter.empty  # default of a parameter that has none


@dataclass(frozen=True)
class Parameter:
    """A parameter of a function, and its value if a call does not give one."""

    name: str
    default: Value = REQUIRED


@dataclass(frozen=True)
class Signature:
    """How a function is called.

    Attributes:
        parameters: In their order; those with defaults are the last ones.
        blocks: Whether it is a generator function. Each bare `yield` in it waits for the next tick; its
            return value is the value of the call.
        cost: Evaluations that a call takes from the budget.
        linear: Whether a call also takes a cost for the elements of list arguments and results. The
            machine charges for this in the functions that it adds itself.
        fails: Why each call fails when the program reaches it; empty for functions that work.
    """

    parameters: tuple[Parameter, ...]
    blocks: bool = False
    cost: int = 1
    linear: bool = False
    fails: str = ""

    @property
    def required(self) -> int:
        """Number of parameters without a default."""
        return sum(parameter.default is REQUIRED for parameter in self.parameters)


Signatures = Mapping[str, Signature]


def signature(function: Callable[..., Any], *, linear: bool = False) -> Signature:
    """Return how scripts call a Python function: its parameters' names and defaults, and its cost by `costs`.

    The function blocks if it is annotated to return a generator or, without annotation, is a generator
    function.

    Args:
        function: A function, or a method of an object. Scripts always give all arguments, in order.
        linear: See `Signature`.
    """
    found = inspect.signature(function)
    returned = found.return_annotation
    plain = returned is inspect.Signature.empty
    blocks = inspect.isgeneratorfunction(function) if plain else get_origin(returned) is Generator
    return Signature(
        tuple(Parameter(name, one.default) for name, one in found.parameters.items()),
        blocks,
        getattr(function, "cost", 1),
        linear,
    )


def names(functions: type) -> list[str]:
    """Return the names of the public methods of a class, in the order of their definition."""
    return [
        name
        for name, method in vars(functions).items()
        if inspect.isfunction(method) and not name.startswith("_")
    ]


def signatures(functions: type) -> dict[str, Signature]:
    """Return the signatures of the public methods of a class by name, in the order of their definition."""
    # Bound to any object, since scripts do not give `self`.
    return {name: signature(vars(functions)[name].__get__(functions)) for name in names(functions)}


def parameters(*required: str, **defaults: Value) -> tuple[Parameter, ...]:
    """Return the parameters of a function that has no method: `parameters("q", a=1.4, v=1.05)`.

    Args:
        required: Names of parameters that every call gives.
        defaults: Names and defaults of the others.
    """
    return (*map(Parameter, required), *(Parameter(name, value) for name, value in defaults.items()))
