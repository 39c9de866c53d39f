"""Mutations of the product for checks of its tests: each changes one operator, constant or branch."""

import ast
import copy
import re
import subprocess
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from itertools import accumulate
from typing import Any

from tools.executed import ROOT

SOURCES = (
    "cli", "clients", "controller", "lab", "protocol", "shaping", "sim_plant", "testing", "tvist_server", "urscript",
    "view",
)  # fmt: skip
PAIRS = (
    "Lt LtE", "Gt GtE", "Eq NotEq", "Is IsNot", "In NotIn", "And Or", "Add Sub", "Mult Div", "FloorDiv Mult",
    "Mod Mult", "Pow Mult", "USub UAdd",
)  # fmt: skip
"""Operators that replace each other. `|` and `&` are left out, since they mostly occur in types."""
OTHER = {new: old for old, new in map(str.split, PAIRS[:8])} | dict(map(str.split, PAIRS))
Mutant = dict[str, Any]


def walk(node: ast.AST, owner: str, hidden: bool, span: tuple[int, int]) -> Iterator[tuple[ast.AST, Mutant]]:
    """Yield all executed nodes: the name each belongs to, whether coverage misses it, and its statement's lines."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.If) and "TYPE_CH" in ast.unparse(node.test)):
        return  # positions in f-strings are wrong before Python 3.12
    if isinstance(node, ast.stmt):
        body = getattr(node, "body", None)
        span = node.lineno, max(node.lineno, body[0].lineno - 1 if body else node.end_lineno or 0)
    if isinstance(node, ast.Assign | ast.AnnAssign) and hidden and not owner:
        owner = ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
    yield node, {"owner": owner, "hidden": hidden, "span": span}
    for field, value in ast.iter_fields(node):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kernel = any("compiled" in ast.unparse(one) for one in node.decorator_list)
            owner, hidden = node.name, kernel or field != "body"
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and field not in {"annotation", "returns"}:
                yield from walk(child, owner, hidden, span)


def changes(node: ast.AST) -> Iterator[tuple[str, Any, str]]:
    """Yield the mutants of a node: kind, the replaced node, and its replacement."""
    if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
        yield "branch", node.test, f"(not ({ast.unparse(node.test)}))"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        yield "constant", node, repr(not node.value if isinstance(node.value, bool) else node.value * 2 or 1)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield "operator", node, f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Compare | ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign):
        other: Any = copy.copy(node)
        operator = type(node.ops[0] if isinstance(node, ast.Compare) else node.op).__name__
        if operator in OTHER:
            changed = getattr(ast, OTHER[operator])()
            other.op, other.ops = changed, [changed, *getattr(node, "ops", ())[1:]]
            yield (
                "operator",
                node,
                ast.unparse(other) if isinstance(node, ast.stmt) else f"({ast.unparse(other)})",
            )


@cache
def product() -> tuple[list[Mutant], dict[str, list[Mutant]]]:
    """Return all mutants, and for each name the places that mention it."""
    listed = subprocess.run(
        ["git", "ls-files", *SOURCES], cwd=ROOT, capture_output=True, text=True, check=True
    )
    mutants, mentions = [], defaultdict(list)
    for file in (one for one in listed.stdout.split() if re.search(r"/tvist_.*\.py$", one)):
        text = (ROOT / file).read_bytes()
        lines = text.splitlines(keepends=True)
        starts = list(accumulate(map(len, lines), initial=0))
        for node, place in walk(ast.parse(text), "", True, (0, 0)):
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
                name = node.id if isinstance(node, ast.Name) else node.attr
                mentions[name].append({"file": file, "line": node.lineno, **place})
            for kind, old, after in changes(node):
                start, end = (
                    starts[old.lineno - 1] + old.col_offset,
                    starts[old.end_lineno - 1] + old.end_col_offset,
                )
                line, before = lines[old.lineno - 1].decode().strip(), text[start:end].decode()
                where = {"file": file, "line": old.lineno, "column": old.col_offset, "text": line}
                mutants.append({**where, "kind": kind, "before": before, "after": after, **place})
    return mutants, mentions
