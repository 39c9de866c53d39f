"""A compiled script; what compiles it is imported with the first."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import CodeType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_urscript.names import Scope


@dataclass(frozen=True)
class Script:
    """A compiled script. It can run any number of times.

    Attributes:
        name: The name of its program; of one without `def` the first word.
        secondary: It is a `sec`, which runs beside the program.
        text: What it was compiled from.
        main: The name of its main function.
        functions: The code of its functions.
        constants: Values that the code uses by name.
        used: The built-in functions that it calls.
        scope: What names mean on its outermost level.
        scopes: Number of its scopes, with those of the program that it is added to.
        idle: It only defines functions, so it ends at once.
        last_lines: Lines of its functions after which nothing follows in them.
    """

    name: str
    secondary: bool
    text: str
    main: str
    functions: tuple[CodeType, ...]
    constants: Mapping[str, object]
    used: frozenset[str]
    scope: "Scope" = field(repr=False)
    scopes: int
    idle: bool = False
    last_lines: frozenset[int] = frozenset()

    def forgetting(self, last: "Script") -> "Script":
        """Return the program for later statements, which know nothing of what was added up to the last one."""
        return replace(self, scopes=last.scopes)
