"""Build a script's tree bottom-up while it is parsed, without recursion, so that nesting cannot overflow the stack."""

import re
from typing import Any, Literal, TypeVar

from lark import Token, Transformer

from tvist_urscript import tree
from tvist_urscript.errors import no_program
from tvist_urscript.values import HIGHEST, LONGEST_TEXT, to_bytes, whole

DEEPEST = 100
"""Most levels of nested expressions; a block counts as BLOCK levels."""
BLOCK = 4

_LABEL = re.compile(r'\$[ \t]*(\d+)[ \t]*"(.*?)"(?:[ \t]+"\w+")*[ \t\r]*(?:#.*)?', re.ASCII)
"""A label: number, name (which may contain quotes), and words such as "noBreak", which are ignored."""

Children = list[Any]
T = TypeVar("T", bound=tree.Node)


class Builder(Transformer[Token, Any]):
    """Makes a node of each rule's children."""

    def start(self, children: Children) -> list[tree.Statement]:
        return children

    block = start

    def function(self, children: Children) -> tree.Function:
        kind, name, *parameters, body = children
        node = tree.Function(name.line, name.column, str(kind), str(name), parameters, body)  # type: ignore[arg-type]
        return _deeper(node, body, [default for _, default in parameters if default is not None])

    def parameter(self, children: Children) -> tuple[tree.Name, tree.Expression | None]:
        return self.name(children), children[1] if len(children) > 1 else None

    def branches(self, children: Children) -> tree.If:
        word, *rest = children
        branches = list(zip(rest[0::2], rest[1::2], strict=False))
        otherwise = rest[-1] if len(rest) % 2 else []
        node = tree.If(word.line, word.column, branches, otherwise)
        return _deeper(node, otherwise, *([condition, *body] for condition, body in branches))

    def loop(self, children: Children) -> tree.While:
        word, condition, body = children
        return _deeper(tree.While(word.line, word.column, condition, body), body, [condition])

    def evaluate(self, children: Children) -> tree.Evaluate:
        (value,) = children
        return _deeper(tree.Evaluate(value.line, value.column, value), children)

    def return_value(self, children: Children) -> tree.Return:
        word, *value = children
        return _deeper(tree.Return(word.line, word.column, value[0] if value else None), value)

    def handle(self, children: Children) -> tree.Handle:
        word, value = children
        return _deeper(tree.Handle(word.line, word.column, str(word), value), [value])  # type: ignore[arg-type]

    def word(self, children: Children) -> tree.Word:
        (word,) = children
        return tree.Word(word.line, word.column, str(word))  # type: ignore[arg-type]

    def label(self, children: Children) -> tree.Label:
        (token,) = children
        found = _LABEL.fullmatch(token)
        if found is None:
            raise no_program(token, "a label is a line with $, a number and a name in quotes")
        if len(found[1]) > 10 or int(found[1]) > HIGHEST:
            raise no_program(token, f"the number of a label is at most {HIGHEST}")
        if len(to_bytes(found[2])) > LONGEST_TEXT:
            raise no_program(token, f"a text is too long, the limit is {LONGEST_TEXT} bytes")
        return tree.Label(token.line, token.column, int(found[1]), found[2])

    def assign(self, children: Children) -> tree.Assign:
        *qualifier, target, equal, value = children
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

    def either(self, children: Children, operator: Literal["or", "xor", "and"] = "or") -> tree.Logic:
        first = children[0]
        return _deeper(tree.Logic(first.line, first.column, operator, children), children)

    def unequal(self, children: Children) -> tree.Logic:
        return self.either(children, "xor")

    def both(self, children: Children) -> tree.Logic:
        return self.either(children, "and")

    def unary(self, children: Children) -> tree.Expression:
        operator, value = children
        if operator == "-" and isinstance(value, tree.Constant) and type(value.value) in (int, float):
            value.value = -value.value  # type: ignore[operator]
            value.line, value.column = operator.line, operator.column
            return value
        return _deeper(tree.Unary(operator.line, operator.column, str(operator), value), [value])  # type: ignore[arg-type]

    def plus(self, children: Children) -> tree.Expression:
        operator, value = children
        if not (isinstance(value, tree.Constant) and type(value.value) in (int, float)):
            raise no_program(operator, "a plus sign needs a number behind it")
        return value

    def binary(self, children: Children) -> tree.Binary:
        left, operator, right = children
        return _deeper(tree.Binary(operator.line, operator.column, str(operator), left, right), [left, right])

    def index(self, children: Children) -> tree.Index:
        value, bracket, *indices = children
        return _deeper(tree.Index(bracket.line, bracket.column, value, indices), [value], indices)

    def member(self, children: Children) -> tree.Member:
        value, name = children
        return _deeper(tree.Member(name.line, name.column, value, str(name)), [value])

    def method(self, children: Children) -> tree.Method:
        value, name, *arguments = children
        return _deeper(tree.Method(name.line, name.column, value, str(name), arguments), [value], arguments)

    def number(self, children: Children) -> tree.Constant:
        (token,) = children
        try:
            value = whole(int(token)) if token.isdigit() else float(token)
        except (ValueError, OverflowError):  # Python reads at most 4300 digits
            value = float("inf")
        if value == float("inf"):
            raise no_program(token, "a number is too large")
        return tree.Constant(token.line, token.column, value)

    def text(self, children: Children) -> tree.Constant:
        (token,) = children
        value = str(token)[1:-1]
        if len(to_bytes(value)) > LONGEST_TEXT:
            raise no_program(token, f"a text is too long, the limit is {LONGEST_TEXT} bytes")
        return tree.Constant(token.line, token.column, value)

    def constant(self, children: Children) -> tree.Constant:
        (token,) = children
        return tree.Constant(token.line, token.column, {"True": True, "False": False, "None": None}[token])

    def name(self, children: Children) -> tree.Name:
        token = children[0]
        return tree.Name(token.line, token.column, str(token))

    def call(self, children: Children) -> tree.Call:
        name, *arguments = children
        node = tree.Call(name.line, name.column, str(name), arguments)
        return _deeper(node, arguments)

    def run(self, children: Children) -> tree.Call:
        _, call = children
        call.runs = True
        return call  # type: ignore[no-any-return]

    def positional(self, children: Children) -> tree.Argument:
        (value,) = children
        return _deeper(tree.Argument(value.line, value.column, None, value), children)

    def named(self, children: Children) -> tree.Argument:
        name, value = children
        return _deeper(tree.Argument(name.line, name.column, str(name), value), [value])

    def listing(self, children: Children) -> tree.Listing:
        bracket, *items = children
        return _deeper(tree.Listing(bracket.line, bracket.column, items), items)

    def parentheses(self, children: Children) -> tree.Expression:
        return self.listing(children) if len(children) > 2 else children[1]


def _deeper(node: T, *parts: list[Any]) -> T:
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
