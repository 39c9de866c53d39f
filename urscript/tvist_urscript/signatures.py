"""What is known of a function when a script is compiled: its parameters, whether it waits, what it costs."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from tvist_urscript.values import Array, Pose, Value


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


def signature(text: str, *, blocks: bool = False, cost: int = 1, linear: bool = False) -> Signature:
    """Read a signature as manuals write it: `signature("q, a=1.4, v=1.05, t=0, r=0")`.

    Raises:
        ValueError: The text is no list of parameters whose defaults are constants.
    """
    try:
        tree = ast.parse(f"lambda {text}: 0", mode="eval").body
    except SyntaxError as error:
        raise ValueError(f"{text!r} is no list of parameters") from error
    assert isinstance(tree, ast.Lambda)
    names = [argument.arg for argument in tree.args.args]
    missing = len(names) - len(tree.args.defaults)
    defaults = [REQUIRED] * missing + [_constant(node) for node in tree.args.defaults]
    return Signature(
        tuple(Parameter(name, default) for name, default in zip(names, defaults, strict=True)),
        blocks,
        cost,
        linear,
    )


def _constant(node: ast.expr) -> Any:
    if isinstance(node, ast.List):
        return Array(_constant(item) for item in node.elts)
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "p":
        inner = node.slice
        return Pose(_constant(item) for item in (inner.elts if isinstance(inner, ast.Tuple) else [inner]))
    return ast.literal_eval(node)
