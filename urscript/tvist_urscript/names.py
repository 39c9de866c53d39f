"""Scopes, which determine the variable or function that a name in a script refers to."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

from tvist_urscript import tree

BUILT_IN_ARRAYS: dict[str, tuple[str, str]] = {
    "digital_in": ("get_digital_in", ""),
    "digital_out": ("get_digital_out", "set_digital_out"),
    "analog_in": ("get_analog_in", ""),
    "analog_out": ("get_analog_out", "set_analog_out"),
}
"""Arrays of the controller, and the functions that read and write an element ("" if it cannot be written)."""

METHOD = "."
"""Built-in function that method calls use; it gets the object, the method's name and the arguments."""


@dataclass(eq=False)
class Scope:
    """The names that one function of a script can use.

    A variable is local if it is a parameter, if `local` has declared it further up, or if no global has its
    name. Every variable assigned on the outermost level is global. A function can call its own inner
    functions and those of the functions around it, but cannot use local variables of the latter.
    """

    function: tree.Function
    outer: "Scope | None"  # scope of the function around this one; None for the outermost level
    number: int  # makes the names of compiled functions unique
    globals: set[str]  # global variables, one set for all scopes of the program
    functions: dict[str, "Scope"] = field(default_factory=dict)  # scopes of direct inner functions, by name
    twice: list[tree.Function] = field(default_factory=list)  # inner functions defined twice, an error
    assigned: set[str] = field(default_factory=set)  # variables assigned in this function without `global`
    local: set[str] = field(default_factory=set)  # parameters, and variables already declared `local`

    @property
    def code_name(self) -> str:
        """Name of the function in compiled code."""
        return f"f{self.number}_{self.function.name}"

    def variable(self, name: str) -> Literal["local", "global"] | None:
        """Return whether a name refers to a local or a global variable here; None: to no variable."""
        if name in self.local:
            return "local"
        if name in self.globals:
            return "global"
        return "local" if name in self.assigned else None

    def declare(self, name: str, qualifier: Literal["global", "local"] | None) -> Literal["local", "global"]:
        """Return whether an assignment sets a local or global variable; `local` holds for later ones, too."""
        if qualifier == "global" or self.outer is None:
            return "global"
        if qualifier == "local":
            self.local.add(name)
        return self.variable(name) or "local"

    def find(self, name: str) -> "Scope | None":
        """Return the scope of the function of this name callable here; None: the script has none."""
        scope: Scope | None = self
        while scope is not None:
            if name in scope.functions:
                return scope.functions[name]
            scope = scope.outer
        return None

    def hint(self, name: str) -> str:
        """Return how to make an unknown name known if a function of the program assigns it; else nothing."""
        scope = self
        while scope.outer is not None:
            scope = scope.outer
        waiting = [scope]
        while waiting:
            scope = waiting.pop()
            if name in scope.assigned:
                title = scope.function.name
                return f" {name} is assigned in {title}, but local to it: declare it global there"
            waiting += reversed(scope.functions.values())
        return ""


def outline(scope: Scope) -> Scope:
    """Return a copy of an outermost scope without function bodies, which compiles statements added later."""
    known = {
        name: Scope(replace(inner.function, body=[]), None, inner.number, set())
        for name, inner in scope.functions.items()
    }
    return Scope(replace(scope.function, body=[]), None, scope.number, set(scope.globals), known)


def scopes(program: tree.Function, before: Scope | None = None, number: int = 0) -> list[Scope]:
    """Return the scopes of a program: its outermost level, then its functions in the order of the text.

    `before` is the outermost scope of a program to which statements are added; `number` is the first scope's.
    """
    shared: set[str] = set() if before is None else set(before.globals)
    found: list[Scope] = []
    waiting: list[tuple[tree.Function, Scope | None]] = [(program, None)]
    while waiting:
        function, outer = waiting.pop()
        scope = Scope(function, outer, number + len(found), shared)
        if not found and before is not None:
            scope.functions.update(before.functions)
        found.append(scope)
        scope.local.update(parameter.name for parameter, _ in function.parameters)
        if outer is not None:
            earlier = outer.functions.get(function.name)
            if earlier is not None and earlier.number >= number:
                outer.twice.append(function)
            outer.functions[function.name] = scope
        inner: list[tree.Function] = []
        for statement in _inside(function.body):
            if isinstance(statement, tree.Function):
                inner.append(statement)
            elif not statement.indices:
                everywhere = outer is None or statement.qualifier == "global"
                (shared if everywhere else scope.assigned).add(statement.target.name)
        waiting += [(function, scope) for function in reversed(inner)]
    return found


def _inside(body: list[tree.Statement]) -> Iterator[tree.Assign | tree.Function]:
    for statement in body:
        if isinstance(statement, tree.Assign | tree.Function):
            yield statement
        elif isinstance(statement, tree.While):
            yield from _inside(statement.body)
        elif isinstance(statement, tree.If):
            for _, branch in statement.branches:
                yield from _inside(branch)
            yield from _inside(statement.otherwise)
