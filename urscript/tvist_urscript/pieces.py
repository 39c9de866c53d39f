"""Small parts of Python's tree, each with a position of the script."""

import ast
from typing import Any

from tvist_urscript.tree import Node

LOAD, STORE = ast.Load(), ast.Store()
HERE, MISSING, DEPTH = "machine", "MISSING", "depth"
"""Names that compiled functions use: the machine, a missing argument, depth."""


class Position:
    """Where a part of Python's tree comes from; it makes such parts.

    Attributes:
        given: The keywords that every node of Python's tree takes.
    """

    __slots__ = ("given",)

    def __init__(self, line: int, column: int) -> None:
        self.given: dict[str, Any] = {
            "lineno": line,
            "col_offset": column,
            "end_lineno": line,
            "end_col_offset": column,
        }

    @classmethod
    def of(cls, node: Node) -> "Position":
        """The position of a script's node."""
        return cls(node.line, node.column)

    def name(self, name: str) -> ast.Name:
        """A variable that is read."""
        return ast.Name(name, LOAD, **self.given)

    def constant(self, value: object) -> ast.Constant:
        """A number, a text, True, False or None."""
        return ast.Constant(value, **self.given)  # type: ignore[arg-type]

    def call(self, name: str, *arguments: ast.expr) -> ast.Call:
        """A call of one of the names of a compiled function's surroundings."""
        return ast.Call(self.name(name), list(arguments), [], **self.given)

    def waiting(self, value: ast.expr) -> ast.YieldFrom:
        """The value of a generator that has come to its end."""
        return ast.YieldFrom(value, **self.given)

    def tuple(self, items: list[ast.expr]) -> ast.Tuple:
        """Several values."""
        return ast.Tuple(items, LOAD, **self.given)

    def assign(self, name: str, value: ast.expr) -> ast.Assign:
        """An assignment."""
        return ast.Assign([ast.Name(name, STORE, **self.given)], value, **self.given)

    def statement(self, value: ast.expr) -> ast.Expr:
        """An expression whose value nobody wants."""
        return ast.Expr(value, **self.given)

    def branch(self, test: ast.expr, body: list[ast.stmt], otherwise: list[ast.stmt] | None = None) -> ast.If:
        """An if."""
        return ast.If(test, body or [ast.Pass(**self.given)], otherwise or [], **self.given)

    def invert(self, value: ast.expr) -> ast.UnaryOp:
        """The opposite truth."""
        return ast.UnaryOp(ast.Not(), value, **self.given)

    def compare(self, left: ast.expr, operator: ast.cmpop, right: ast.expr) -> ast.Compare:
        """A comparison of Python's own."""
        return ast.Compare(left, [operator], [right], **self.given)

    def charge(self, cost: int, *, check: bool) -> list[ast.stmt]:
        """Take a cost from the budget; where that is spent, yield the cost, to be paid in the tick that bears it."""
        if cost == 0 and not check:
            return []
        left = ast.Attribute(self.name(HERE), "left", STORE, **self.given)
        statements: list[ast.stmt] = [ast.AugAssign(left, ast.Sub(), self.constant(cost), **self.given)]
        if check:
            present = ast.Attribute(self.name(HERE), "left", LOAD, **self.given)
            spent = ast.Yield(self.constant(cost), **self.given)
            statements.append(
                self.branch(self.compare(present, ast.Lt(), self.constant(0)), [self.statement(spent)])
            )
        return statements
