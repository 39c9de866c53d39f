"""The syntax tree of a script; each node has the position of the token that errors refer to."""

from dataclasses import dataclass, field
from typing import Literal


@dataclass(slots=True)
class Node:
    """A part of a script."""

    line: int  # line of its token, from 1
    column: int  # column of its token, from 1
    depth: int = field(default=1, init=False)  # levels of nodes below it
    size: int = field(default=1, init=False)  # number of nodes from it down, without constants and functions


@dataclass(slots=True)
class Constant(Node):
    """A number, a string, True, False or None."""

    value: int | float | bool | str | None


@dataclass(slots=True)
class Name(Node):
    """A variable that is read or assigned."""

    name: str


@dataclass(slots=True)
class Listing(Node):
    """`[a, b]` or `(a, b)`."""

    items: list["Expression"]


@dataclass(slots=True)
class Index(Node):
    """`a[i]` or `m[i, j]`, or a pose if the name is `p` and there are six indices."""

    value: "Expression"
    indices: list["Expression"]


@dataclass(slots=True)
class Member(Node):
    """`a.name`, with the position of `name`."""

    value: "Expression"
    name: str


@dataclass(slots=True)
class Method(Node):
    """`a.name(arguments)`, with the position of `name`."""

    value: "Expression"
    name: str
    arguments: list["Argument"]


@dataclass(slots=True)
class Step(Node):
    """`.name` in the target of an assignment."""

    name: str


@dataclass(slots=True)
class Argument(Node):
    """An argument of a call, with its name if it is given by name."""

    name: str | None
    value: "Expression"


@dataclass(slots=True)
class Call(Node):
    """`name(arguments)`, or `run name(arguments)`."""

    name: str
    arguments: list[Argument]
    runs: bool = False


@dataclass(slots=True)
class Unary(Node):
    """`-a` or `not a`."""

    operator: Literal["-", "not"]
    value: "Expression"


@dataclass(slots=True)
class Binary(Node):
    """Arithmetic or a comparison, with the position of the operator."""

    operator: str
    left: "Expression"
    right: "Expression"


@dataclass(slots=True)
class Logic(Node):
    """`a and b and c`, or the same with `or` or `xor`."""

    operator: Literal["and", "or", "xor"]
    values: list["Expression"]


Expression = Constant | Name | Listing | Index | Member | Method | Call | Unary | Binary | Logic


@dataclass(slots=True)
class Assign(Node):
    """`target = value`, perhaps after `global` or `local`; `indices` lead to an element or a member of the target."""

    target: Name
    indices: list[Expression | Step]
    value: Expression
    qualifier: Literal["global", "local"] | None = None


@dataclass(slots=True)
class Evaluate(Node):
    """An expression as a statement."""

    value: Expression


@dataclass(slots=True)
class If(Node):
    """`if` with its `elif` and `else`: a condition and statements for each branch."""

    branches: list[tuple[Expression, list["Statement"]]]
    otherwise: list["Statement"]


@dataclass(slots=True)
class While(Node):
    """`while`, the only loop."""

    condition: Expression
    body: list["Statement"]


@dataclass(slots=True)
class Return(Node):
    """`return`, with or without a value."""

    value: Expression | None


@dataclass(slots=True)
class Handle(Node):
    """`kill` or `join` of a thread's handle."""

    word: Literal["kill", "join"]
    value: Expression


@dataclass(slots=True)
class Word(Node):
    """A statement that consists of a keyword."""

    word: Literal["break", "continue", "halt", "pass", "enter_critical", "exit_critical"]


@dataclass(slots=True)
class Label(Node):
    """`$ 3 "Waypoint_1"`: the line of PolyScope's program tree to which the next statements belong."""

    number: int
    name: str


@dataclass(slots=True)
class Function(Node):
    """A function, a thread, or a whole program, with the position of its name."""

    kind: Literal["def", "sec", "thread"]
    name: str
    parameters: list[tuple[Name, Expression | None]]
    body: list["Statement"]


Statement = Assign | Evaluate | If | While | Return | Handle | Word | Label | Function
