"""The names that the compiled code of one program uses."""

import re
from collections.abc import Callable, Collection, Mapping
from types import FunctionType
from typing import Any

from tvist_urscript.library import ANEW, PURE, WEIGHTS
from tvist_urscript.operators import operators
from tvist_urscript.script import Script
from tvist_urscript.values import Array

_NUMBERED = re.compile(r"[fc](\d+)_")
"""Names of functions and constants in compiled code, with the number of their scope."""


class Namespace:
    """The functions, constants and variables of a program and of the statements that are added to it.

    Args:
        script: The program.
        functions: The built-in functions that scripts may call, without those of `PURE`.
        charge: Takes the elements of a list from the program's budget.
        machine: What compiled code calls of the machine that runs it, by name.

    Raises:
        ValueError: The program calls a function that is not given.
    """

    def __init__(
        self,
        script: Script,
        functions: Mapping[str, Callable[..., Any]],
        charge: Callable[[int], None],
        machine: Mapping[str, Any],
    ) -> None:
        self._functions, self._charge = functions, charge
        self._names: dict[str, Any] = {"__builtins__": {}, **operators(charge), **machine}
        self.include(script)
        self._own = frozenset(self._names)
        """Names of the program's functions, constants and built-in functions."""

    def __getitem__(self, name: str) -> Any:
        return self._names[name]

    def include(self, script: Script) -> None:
        """Make the functions of a script, and what they use, known to compiled code.

        Raises:
            ValueError: The script calls a function that is not given.
        """
        self._names |= script.constants
        for name in script.used:
            self._names[f"b_{name}"] = self._built_in(name)
        for code in script.functions:
            self._names[code.co_name] = FunctionType(code, self._names)

    def forget(self, before: int, variables: Collection[str]) -> None:
        """Forget what was included after the program.

        Args:
            before: Number of the first scope whose functions are kept.
            variables: The variables that are kept.
        """
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
                self._charge(result.size // 3)  # made at once, not one by one
            return result

        return charged
