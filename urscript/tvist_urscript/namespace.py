"""The global names of one program's compiled code."""

import re
from collections.abc import Callable, Collection, Mapping
from types import FunctionType
from typing import Any

from tvist_urscript import arithmetic
from tvist_urscript.arithmetic import Work
from tvist_urscript.library import ANEW, PURE, WEIGHTS
from tvist_urscript.script import Script
from tvist_urscript.values import Array, Pose, Struct

_NUMBERED = re.compile(r"[fc](\d+)_")
"""Names of functions and constants in compiled code, with the number of their scope."""


class Namespace:
    """The functions, constants and variables of a program and of the statements that are added to it.

    `functions` are built-in functions besides those of `PURE`; `charge` takes a cost from the budget;
    `machine` has what compiled code uses of its machine, by name.
    """

    def __init__(
        self,
        script: Script,
        functions: Mapping[str, Callable[..., Any]],
        charge: Callable[[int], None],
        machine: Mapping[str, Any],
    ) -> None:
        self._functions, self._charge = functions, charge
        self._names: dict[str, Any] = {"__builtins__": {}, **_operators(charge), **machine}
        self.include(script)
        self._own = frozenset(self._names)
        """Names of the program's functions, constants and built-in functions."""

    def __getitem__(self, name: str) -> Any:
        return self._names[name]

    def include(self, script: Script) -> None:
        """Add the functions of a script, and the constants and built-in functions that they use."""
        self._names |= script.constants
        for name in script.used:
            self._names[f"b_{name}"] = self._built_in(name)
        for code in script.functions:
            self._names[code.co_name] = FunctionType(code, self._names)

    def forget(self, before: int, variables: Collection[str]) -> None:
        """Remove what was added to the program: scopes below `before`, and globals not in `variables`."""
        for name in self._names.keys() - self._own:
            found = _NUMBERED.match(name)
            of_variable = name.startswith("g_") and name[2:] not in variables
            if of_variable or (found is not None and int(found[1]) < before):
                del self._names[name]

    def _built_in(self, name: str) -> Callable[..., Any]:
        if name in self._functions:
            return self._functions[name]
        if name in ANEW:
            return self._names.get(f"b_{name}") or ANEW[name]()
        if name not in PURE:
            raise ValueError(f"the script calls {name}, which is not given")
        signature, function = PURE[name]
        if not signature.linear:
            return function

        weight = WEIGHTS[name]

        def charged(*arguments: Any) -> Any:
            self._charge(weight * sum(argument.size for argument in arguments if isinstance(argument, Array)))
            result = function(*arguments)
            if isinstance(result, Array):
                self._charge(result.size // 3)  # cheaper per element, since all are created at once
            return result

        return charged


def _operators(work: Work) -> Mapping[str, Callable[..., Any]]:
    """Return the operators of a machine, which charge for list elements through `work`.

    For two floats, the most frequent case, they do the least work.
    """

    def add(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a + b
        return arithmetic.combine(arithmetic.total, a, b, "added", work)

    def subtract(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a - b
        return arithmetic.combine(arithmetic.difference, a, b, "subtracted", work)

    def multiply(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a * b
        return arithmetic.multiply(a, b, work)

    def is_equal(a: Any, b: Any) -> bool:
        if isinstance(a, Array):
            work(a.size // 3)
        return bool(a == b)

    return {
        "add": add,
        "subtract": subtract,
        "multiply": multiply,
        "divide": lambda a, b: arithmetic.combine(arithmetic.quotient, a, b, "divided", work),
        "remainder": lambda a, b: arithmetic.combine(arithmetic.rest, a, b, "divided", work),
        "negate": lambda a: arithmetic.negate(a, work),
        "is_equal": is_equal,
        "is_unequal": lambda a, b: not is_equal(a, b),
        "element": arithmetic.element,
        "member": arithmetic.member,
        "element_of_matrix": arithmetic.element_of_matrix,
        "replaced": lambda new, indices, value: arithmetic.replaced(new, indices, value, work),
        "listed": Array,
        "structured": Struct,
        "arranged": lambda order, values: [values[place] for place in order],
        "posed": Pose,
    }
