"""Structs, their members, and methods as Python's expressions."""

import ast
from abc import ABC, abstractmethod
from collections.abc import Callable

from tvist_urscript import tree
from tvist_urscript.errors import name_not_found
from tvist_urscript.names import METHOD
from tvist_urscript.pieces import Position
from tvist_urscript.signatures import Signatures
from tvist_urscript.values import LONGEST


class Members(ABC):
    """Translates what has a point in it, and what makes it; the attributes are those of `Expressions`."""

    signatures: Signatures
    report: Callable[[int, int, str], None]
    cost: int
    used: set[str]

    @abstractmethod
    def value(self, node: tree.Expression) -> ast.expr:
        """Translate an expression for its value."""

    def struct(self, node: tree.Call) -> ast.expr:
        """Translate `struct(a=1, b=2)`."""
        at = Position.of(node)
        names = [argument.name for argument in node.arguments]
        if not 1 <= len(names) <= LONGEST:
            self.report(node.line, node.column, f"struct takes from 1 to {LONGEST} members, not {len(names)}")
        seen: set[str] = set()
        for argument in node.arguments:
            if argument.name is None:
                why = "struct needs a name for each member, as in struct(x=1)"
                self.report(argument.line, argument.column, why)
            elif argument.name in seen:
                self.report(argument.line, argument.column, f"struct is given {argument.name} twice")
            else:
                seen.add(argument.name)
        self.cost += len(names)
        values = at.tuple([self.value(argument.value) for argument in node.arguments])
        return at.call("structured", at.tuple([at.constant(name) for name in names]), values)

    def member(self, node: tree.Member) -> ast.expr:
        """Translate `a.name`."""
        self.cost += 1
        at = Position.of(node)
        return at.call("member", self.value(node.value), at.constant(node.name))

    def method(self, node: tree.Method) -> ast.expr:
        """Translate `a.name(arguments)`, of which only the controller knows what it is."""
        at = Position.of(node)
        self.cost += 1 + len(node.arguments)
        value = self.value(node.value)
        arguments = at.tuple([self.value(argument.value) for argument in node.arguments])
        if METHOD not in self.signatures:
            self.report(node.line, node.column, name_not_found(f"{METHOD}{node.name}"))
            return at.constant(None)
        self.used.add(METHOD)
        return at.call(f"b_{METHOD}", value, at.constant(node.name), arguments)
