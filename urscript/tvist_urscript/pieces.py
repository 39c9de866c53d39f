"""Build nodes of Python's tree with positions in the script."""

import ast
from typing import Any

from tvist_urscript.tree import Node

LOAD, STORE = ast.Load(), ast.Store()
HERE, MISSING, DEPTH = "machine", "MISSING", "depth"
"""Names in compiled functions: the machine, a missing argument, the depth of calls."""


class AstBuilder:
    """A position in the script; its methods return nodes of Python's tree with this position."""

    __slots__ = ("given",)

    def __init__(self, line: int, column: int) -> None:
        self.given: dict[str, Any] = {  # keywords that every node of Python's tree takes
            "lineno": line,
            "col_offset": column,
            "end_lineno": line,
            "end_col_offset": column,
        }

    @classmethod
    def of(cls, node: Node) -> "AstBuilder":
        """Return the position of a node of a script's tree."""
        return cls(node.line, node.column)

    def name(self, name: str) -> ast.Name:
        """Return a name that is read."""
        return ast.Name(name, LOAD, **self.given)

    def constant(self, value: object) -> ast.Constant:
        """Return a literal: a number, a text, True, False or None."""
        return ast.Constant(value, **self.given)  # type: ignore[arg-type]

    def call(self, name: str, *arguments: ast.expr) -> ast.Call:
        """Return a call of a global name of the compiled code, with arguments by position."""
        return ast.Call(self.name(name), list(arguments), [], **self.given)

    def waiting(self, value: ast.expr) -> ast.YieldFrom:
        """Return `yield from value`, which passes on a generator's ticks and returns its result."""
        return ast.YieldFrom(value, **self.given)

    def tuple(self, items: list[ast.expr]) -> ast.Tuple:
        """Return a tuple display."""
        return ast.Tuple(items, LOAD, **self.given)

    def assign(self, name: str, value: ast.expr) -> ast.Assign:
        """Return an assignment to a name."""
        return ast.Assign([ast.Name(name, STORE, **self.given)], value, **self.given)

    def statement(self, value: ast.expr) -> ast.Expr:
        """Return an expression as a statement."""
        return ast.Expr(value, **self.given)

    def branch(self, test: ast.expr, body: list[ast.stmt], otherwise: list[ast.stmt] | None = None) -> ast.If:
        """Return an `if`; an empty body becomes `pass`."""
        return ast.If(test, body or [ast.Pass(**self.given)], otherwise or [], **self.given)

    def invert(self, value: ast.expr) -> ast.UnaryOp:
        """Return `not value`."""
        return ast.UnaryOp(ast.Not(), value, **self.given)

    def compare(self, left: ast.expr, operator: ast.cmpop, right: ast.expr) -> ast.Compare:
        """Return a comparison by Python's operator, not by one of the script's."""
        return ast.Compare(left, [operator], [right], **self.given)

    def charge(self, cost: int, *, check: bool) -> list[ast.stmt]:
        """Return statements that take a cost from the budget and, with `check`, yield it if the budget is spent.

        The machine charges a yielded cost to a later tick.
        """
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
