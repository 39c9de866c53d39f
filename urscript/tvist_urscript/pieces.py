"""Build nodes of Python's tree.

A node gets a position in the script by `located`; `ast.fix_missing_locations` gives it to the nodes below as well.
"""

import ast
from typing import TypeVar

from tvist_urscript.tree import Node

HERE, MISSING, DEPTH = "machine", "MISSING", "depth"
"""Names in compiled functions: the machine, a missing argument, the depth of calls."""
LOAD, STORE = ast.Load(), ast.Store()
Made = TypeVar("Made", bound=ast.expr | ast.stmt)


def located(made: Made, node: Node) -> Made:
    """Unless `made` has a position, give it the position of a node of the script's tree."""
    if not hasattr(made, "lineno"):
        made.lineno = made.end_lineno = node.line
        made.col_offset = made.end_col_offset = node.column
    return made


def name(name: str) -> ast.Name:
    """Return a name that is read."""
    return ast.Name(name, LOAD)


def call(function: str, *arguments: ast.expr) -> ast.Call:
    """Return a call of a global name of the compiled code, with arguments by position."""
    return ast.Call(name(function), list(arguments), [])


def assign(variable: str, value: ast.expr) -> ast.Assign:
    """Return an assignment to a name."""
    return ast.Assign([ast.Name(variable, STORE)], value)


def branch(test: ast.expr, body: list[ast.stmt], otherwise: list[ast.stmt] | None = None) -> ast.If:
    """Return an `if`; an empty body becomes `pass`."""
    return ast.If(test, body or [ast.Pass()], otherwise or [])


def invert(value: ast.expr) -> ast.UnaryOp:
    """Return `not value`."""
    return ast.UnaryOp(ast.Not(), value)


def compare(left: ast.expr, operator: ast.cmpop, right: ast.expr) -> ast.Compare:
    """Return a comparison by Python's operator, not by one of the script's."""
    return ast.Compare(left, [operator], [right])


def charge(cost: int, *, check: bool) -> list[ast.stmt]:
    """Return statements that charge a cost and, with `check`, yield the cost if the budget is spent.

    The machine charges a yielded cost to a later tick.
    """
    if cost == 0 and not check:
        return []
    left = ast.Attribute(name(HERE), "left", STORE)
    statements: list[ast.stmt] = [ast.AugAssign(left, ast.Sub(), ast.Constant(cost))]
    if check:
        spent = compare(ast.Attribute(name(HERE), "left", LOAD), ast.Lt(), ast.Constant(0))
        statements.append(branch(spent, [ast.Expr(ast.Yield(ast.Constant(cost)))]))
    return statements
