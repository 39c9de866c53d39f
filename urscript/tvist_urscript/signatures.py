"""What is known of a function when a script is compiled: its parameters, whether it waits, what it costs."""

import inspect
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any, Final, get_origin

from tvist_urscript.costs import cost_of
from tvist_urscript.values import Value


class _Required:
    """The default of a parameter without one."""

    def __repr__(self) -> str:
        return "REQUIRED"


REQUIRED: Final = _Required()


@dataclass(frozen=True)
class Parameter:
    """A parameter of a function and its value where a call does not give one."""

    name: str
    default: Value | _Required = REQUIRED


@dataclass(frozen=True)
class Signature:
    """How a function is called.

    Attributes:
        parameters: In their order; those with defaults are the last ones.
        blocks: It is a generator function. Each bare `yield` inside it waits for the next tick; what it returns is the
            value of the call.
        cost: Evaluations that a call takes from the budget.
        linear: Elements of the lists that it takes and gives are taken from the budget as well. The machine sees to it
            for the functions that it adds itself.
    """

    parameters: tuple[Parameter, ...]
    blocks: bool = False
    cost: int = 1
    linear: bool = False

    @property
    def required(self) -> int:
        """Number of the parameters without a default."""
        return sum(parameter.default is REQUIRED for parameter in self.parameters)


Signatures = Mapping[str, Signature]


def signature(function: Callable[..., Any], *, linear: bool = False) -> Signature:
    """Return how scripts call a function of Python: with its parameters by their names, and its defaults.

    It blocks if it returns a generator, by its annotation or, without one, because it is a generator function. Its cost
    is that of `costs`.

    Args:
        function: A function, or a method of an object. Scripts always give all arguments, in order.
        linear: See `Signature`.
    """
    found = inspect.signature(function)
    returned = found.return_annotation
    if returned is inspect.Signature.empty:
        blocks = inspect.isgeneratorfunction(function)
    else:
        blocks = get_origin(returned) is Generator
    return Signature(
        tuple(
            Parameter(name, REQUIRED if one.default is inspect.Parameter.empty else one.default)
            for name, one in found.parameters.items()
        ),
        blocks,
        cost_of(function),
        linear,
    )


def names(functions: type) -> list[str]:
    """Return the names of the public methods of a class, in the order of the class."""
    return [
        name
        for name, method in vars(functions).items()
        if inspect.isfunction(method) and not name.startswith("_")
    ]


def signatures(functions: type) -> dict[str, Signature]:
    """Return how scripts call the public methods of a class, by name and in the order of the class."""
    # Bound to anything: scripts do not give `self`.
    return {name: signature(vars(functions)[name].__get__(functions)) for name in names(functions)}


def parameters(*required: str, **defaults: Value) -> tuple[Parameter, ...]:
    """Return the parameters of a function that has no method of its own: `parameters("q", a=1.4, v=1.05)`.

    Args:
        required: Names of those that every call gives.
        defaults: Names and defaults of the others.
    """
    return (*map(Parameter, required), *(Parameter(name, value) for name, value in defaults.items()))
