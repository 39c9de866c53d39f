"""Builds a script's tree bottom-up during parsing without recursion, so nesting cannot overflow the stack."""

import re
from collections.abc import Sequence
from typing import Any, Literal, TypeVar

from lark import Token, Transformer, v_args

from tvist_urscript import tree
from tvist_urscript.errors import no_program
from tvist_urscript.values import HIGHEST, LONGEST_TEXT, to_bytes, whole

DEEPEST = 100  # most levels of nested expressions; a block counts as BLOCK levels
BLOCK = 4

_LABEL = re.compile(r'\$[ \t]*(\d+)[ \t]*"(.*?)"(?:[ \t]+"\w+")*[ \t\r]*(?:#.*)?', re.ASCII)
"""A label: number, name (which may contain quotes), and words such as "noBreak", which are ignored."""

T = TypeVar("T", bound=tree.Node)


@v_args(inline=True)
class Builder(Transformer[Token, Any]):
    """Creates the node of a grammar's rule from the nodes of its parts."""

    def start(self, *children: Any) -> list[tree.Statement]:
        return list(children)

    block = start

    def function(self, kind: Any, name: Any, *rest: Any) -> tree.Function:
        *parameters, body = rest
        node = tree.Function(name.line, name.column, str(kind), str(name), parameters, body)  # type: ignore[arg-type]
        return _deeper(node, body, [default for _, default in parameters if default is not None])

    def parameter(self, name: Any, default: Any = None) -> tuple[tree.Name, tree.Expression | None]:
        return self.name(name), default

    def branches(self, word: Any, *rest: Any) -> tree.If:
        branches = list(zip(rest[0::2], rest[1::2], strict=False))
        otherwise = rest[-1] if len(rest) % 2 else []
        node = tree.If(word.line, word.column, branches, otherwise)
        return _deeper(node, otherwise, *([condition, *body] for condition, body in branches))

    def loop(self, word: Any, condition: Any, body: Any) -> tree.While:
        return _deeper(tree.While(word.line, word.column, condition, body), body, [condition])

    def evaluate(self, value: Any) -> tree.Evaluate:
        return _deeper(tree.Evaluate(value.line, value.column, value), [value])

    def return_value(self, word: Any, *value: Any) -> tree.Return:
        return _deeper(tree.Return(word.line, word.column, value[0] if value else None), value)

    def handle(self, word: Any, value: Any) -> tree.Handle:
        return _deeper(tree.Handle(word.line, word.column, str(word), value), [value])  # type: ignore[arg-type]

    def word(self, word: Any) -> tree.Word:
        return tree.Word(word.line, word.column, str(word))  # type: ignore[arg-type]

    def label(self, token: Any) -> tree.Label:
        found = _LABEL.fullmatch(token)
        if found is None:
            raise no_program(token, "a label is a line with $, a number and a name in quotes")
        if len(found[1]) > 10 or int(found[1]) > HIGHEST:
            raise no_program(token, f"the number of a label is at most {HIGHEST}")
        if len(to_bytes(found[2])) > LONGEST_TEXT:
            raise no_program(token, f"a text is too long: the limit is {LONGEST_TEXT} bytes")
        return tree.Label(token.line, token.column, int(found[1]), found[2])

    def assign(self, *parts: Any) -> tree.Assign:
        *qualifier, target, equal, value = parts
        indices: list[tree.Expression | tree.Step] = []
        inner, bracket = target, target
        while isinstance(inner, tree.Index | tree.Member):
            if isinstance(inner, tree.Index):
                indices[:0] = inner.indices
            else:
                indices.insert(0, tree.Step(inner.line, inner.column, inner.name))
            inner, bracket = inner.value, inner
        if not isinstance(inner, tree.Name):
            at = inner if qualifier else equal
            raise no_program(at, "only a variable, or an element or member of one, can be assigned")
        if qualifier and indices:
            raise no_program(bracket, f"{qualifier[0]} declares a variable, not an element or a member")
        declared: Any = str(qualifier[0]) if qualifier else None
        node = tree.Assign(inner.line, inner.column, inner, indices, value, declared)
        return _deeper(node, indices, [value])

    def chained(self, *parts: Any) -> None:
        _, equal, _ = parts
        raise no_program(equal, "a statement assigns one variable: write `b = 1`, then `a = b`")

    def either(self, *values: Any, operator: Literal["or", "xor", "and"] = "or") -> tree.Logic:
        first, *_ = values
        return _deeper(tree.Logic(first.line, first.column, operator, [*values]), values)

    def unequal(self, *values: Any) -> tree.Logic:
        return self.either(*values, operator="xor")

    def both(self, *values: Any) -> tree.Logic:
        return self.either(*values, operator="and")

    def unary(self, operator: Any, value: Any) -> tree.Expression:
        if operator == "-" and isinstance(value, tree.Constant) and type(value.value) in (int, float):
            value.value = -value.value  # type: ignore[operator]
            value.line, value.column = operator.line, operator.column
            return value
        return _deeper(tree.Unary(operator.line, operator.column, str(operator), value), [value])  # type: ignore[arg-type]

    def plus(self, operator: Any, value: Any) -> tree.Expression:
        if not (isinstance(value, tree.Constant) and type(value.value) in (int, float)):
            raise no_program(operator, "a plus sign needs a number behind it")
        return value

    def binary(self, left: Any, operator: Any, right: Any) -> tree.Binary:
        return _deeper(tree.Binary(operator.line, operator.column, str(operator), left, right), [left, right])

    def index(self, value: Any, bracket: Any, *indices: Any) -> tree.Index:
        return _deeper(tree.Index(bracket.line, bracket.column, value, [*indices]), [value], indices)

    def member(self, value: Any, name: Any) -> tree.Member:
        return _deeper(tree.Member(name.line, name.column, value, str(name)), [value])

    def method(self, value: Any, name: Any, *arguments: Any) -> tree.Method:
        return _deeper(
            tree.Method(name.line, name.column, value, str(name), [*arguments]), [value], arguments
        )

    def number(self, token: Any) -> tree.Constant:
        try:
            value = whole(int(token)) if token.isdigit() else float(token)
        except (ValueError, OverflowError):  # Python reads at most 4300 digits
            value = float("inf")
        if value == float("inf"):
            raise no_program(token, "a number is too large")
        return tree.Constant(token.line, token.column, value)

    def text(self, token: Any) -> tree.Constant:
        value = str(token)[1:-1]
        if len(to_bytes(value)) > LONGEST_TEXT:
            raise no_program(token, f"a text is too long: the limit is {LONGEST_TEXT} bytes")
        return tree.Constant(token.line, token.column, value)

    def constant(self, token: Any) -> tree.Constant:
        return tree.Constant(token.line, token.column, {"True": True, "False": False, "None": None}[token])

    def name(self, token: Any) -> tree.Name:
        return tree.Name(token.line, token.column, str(token))

    def call(self, name: Any, *arguments: Any) -> tree.Call:
        return _deeper(tree.Call(name.line, name.column, str(name), [*arguments]), arguments)

    def run(self, _: Any, call: Any) -> tree.Call:
        call.runs = True
        return call  # type: ignore[no-any-return]

    def positional(self, value: Any) -> tree.Argument:
        return _deeper(tree.Argument(value.line, value.column, None, value), [value])

    def named(self, name: Any, value: Any) -> tree.Argument:
        return _deeper(tree.Argument(name.line, name.column, str(name), value), [value])

    def listing(self, bracket: Any, *items: Any) -> tree.Listing:
        return _deeper(tree.Listing(bracket.line, bracket.column, [*items]), items)

    def parentheses(self, bracket: Any, *items: Any) -> tree.Expression:
        return self.listing(bracket, *items) if len(items) > 1 else items[0]


def _deeper(node: T, *parts: Sequence[Any]) -> T:
    deepest = 0
    for part in parts:
        for child in part:
            deepest = max(deepest, child.depth)
            if not isinstance(child, tree.Constant | tree.Function):
                node.size += child.size
    if isinstance(node, tree.If):
        node.size += len(node.branches)
    node.depth = deepest + (BLOCK if isinstance(node, tree.If | tree.While | tree.Function) else 1)
    if node.depth > DEEPEST:
        raise no_program(node, f"more than {DEEPEST} levels are nested here")
    return node
