"""Compiled scripts; this module does not import the compiler."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import CodeType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_urscript.names import Scope


@dataclass(frozen=True)
class Script:
    """A compiled script, which can run any number of times.

    Attributes:
        name: Name of its program; without a `def`, its first word.
        secondary: Whether it is a `sec`, which runs beside the program.
        text: Text that it was compiled from.
        main: Name of its main function.
        functions: Code of its functions.
        constants: Values that the code uses by name.
        used: Built-in functions that it calls.
        scope: Scope of its outermost level.
        scopes: Number of its scopes, including those of the program to which the script is added.
        idle: Whether it only defines functions, so that it ends at once.
        last_lines: Last lines of its functions, after which they do nothing more.
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
        """Return the program to which later statements are added; they can use nothing added up to `last`."""
        return replace(self, scopes=last.scopes)
