"""Translate expressions of a script to Python's.

Arithmetic becomes calls of functions that check the operands; comparisons become Python's own.
"""

import ast
from collections.abc import Callable, Sequence

from tvist_urscript import tree
from tvist_urscript.errors import name_not_found
from tvist_urscript.names import BUILT_IN_ARRAYS, METHOD, Scope
from tvist_urscript.pieces import DEPTH, MISSING, AstBuilder
from tvist_urscript.signatures import REQUIRED, Parameter, Signatures
from tvist_urscript.values import LONGEST, NUMBERS, Array, Pose

MOST_OPERATIONS = 1000
"""Most evaluations of one statement, since nothing can interrupt it."""
START = 20
"""Cost of starting a thread, which limits how many threads start in a tick."""

ARITHMETIC = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "%": "remainder"}
ORDER: dict[str, type[ast.cmpop]] = {"<": ast.Lt, ">": ast.Gt, "<=": ast.LtE, ">=": ast.GtE}
EQUALITY: dict[str, tuple[type[ast.cmpop], str]] = {
    "==": (ast.Eq, "is_equal"),
    "!=": (ast.NotEq, "is_unequal"),
}

Report = Callable[[tree.Node, str], None]


class Expressions:
    """Translates expressions."""

    def __init__(self, signatures: Signatures, report: Report) -> None:
        self.signatures = signatures
        self.report = report
        self.scope: Scope  # the names that the present function can use
        self.cost = 0  # evaluations of everything translated since it was reset
        self.works = False  # whether code translated since the reset may work on lists, which costs more
        self.used: set[str] = set()  # built-in functions that the script calls
        self.constants: dict[str, object] = {}  # lists and default values, by their names in compiled code
        self.globals: set[str] = set()

    def value(self, node: tree.Expression) -> ast.expr:  # noqa: C901, PLR0911  one for each kind of node
        """Translate an expression whose value is needed."""
        match node:
            case tree.Constant():
                return AstBuilder.of(node).constant(node.value)
            case tree.Name():
                return self.name(node)
            case tree.Binary():
                return self.binary(node)
            case tree.Call():
                return self.run(node) if node.runs else self.call(node)
            case tree.Index():
                return self.index(node)
            case tree.Member():
                return self.member(node)
            case tree.Method():
                return self.method(node)
            case tree.Listing():
                return self.listing(node)
            case tree.Unary(operator="-"):
                self.cost += 1
                self.works = True
                return AstBuilder.of(node).call("negate", self.value(node.value))
            case tree.Unary():
                return AstBuilder.of(node).invert(self.test(node.value))
            case tree.Logic():
                at = AstBuilder.of(node)
                return at.invert(at.invert(self.test(node)))

    def test(self, node: tree.Expression) -> ast.expr:
        """Translate an expression of which only the truth is needed."""
        match node:
            case tree.Logic(operator="xor"):
                at = AstBuilder.of(node)
                result = at.invert(self.test(node.values[0]))
                self.cost += len(node.values) - 1
                for value in node.values[1:]:
                    result = at.invert(at.compare(result, ast.NotEq(), at.invert(self.test(value))))
                return at.invert(result)
            case tree.Logic():
                self.cost += len(node.values) - 1
                operator = ast.And() if node.operator == "and" else ast.Or()
                return ast.BoolOp(
                    operator, [self.test(value) for value in node.values], **AstBuilder.of(node).given
                )
            case tree.Unary(operator="not"):
                self.cost += 1
                return AstBuilder.of(node).invert(self.test(node.value))
            case _:
                return self.value(node)

    def name(self, node: tree.Name) -> ast.expr:
        """Translate a variable that is read."""
        at = AstBuilder.of(node)
        variable = self.scope.variable(node.name)
        if variable is None:
            self.report(node, name_not_found(node.name))
        return at.name(f"v_{node.name}" if variable == "local" else f"g_{node.name}")

    def binary(self, node: tree.Binary) -> ast.expr:
        """Translate arithmetic or a comparison."""
        at = AstBuilder.of(node)
        self.cost += 1
        left, right = self.value(node.left), self.value(node.right)
        if node.operator in ARITHMETIC:
            self.works = True
            return at.call(ARITHMETIC[node.operator], left, right)
        if node.operator in ORDER:
            return at.compare(left, ORDER[node.operator](), right)
        operator, function = EQUALITY[node.operator]
        if isinstance(node.left, tree.Constant) or isinstance(node.right, tree.Constant):
            return at.compare(left, operator(), right)
        self.works = True
        return at.call(function, left, right)

    def listing(self, node: tree.Listing) -> ast.expr:
        """Translate a list; a list of constants is created only once."""
        at = AstBuilder.of(node)
        if len(node.items) > LONGEST:
            self.report(node, f"a list of {len(node.items)} elements is too long: the limit is {LONGEST}")
            return at.constant(None)
        values = [item.value for item in node.items if isinstance(item, tree.Constant)]
        if len(values) == len(node.items):
            return at.name(self.keep(Array(values)))
        self.cost += len(node.items)
        return at.call("listed", at.tuple([self.value(item) for item in node.items]))

    def keep(self, value: object) -> str:
        """Return a name for a value that compiled functions use."""
        name = f"c{self.scope.number}_{len(self.constants)}"
        self.constants[name] = value
        return name

    def default(self, function: str, parameter: Parameter) -> str:
        """Return a name for the default of a built-in function's parameter."""
        name = f"d_{function}_{parameter.name}"
        self.constants[name] = parameter.default
        return name

    def index(self, node: tree.Index) -> ast.expr:
        """Translate an element, or a pose: `p[...]` with six expressions."""
        value, indices = node.value, node.indices
        at = AstBuilder(*first(indices[0]))
        is_p = isinstance(value, tree.Name) and value.name == "p"
        if is_p and len(indices) == 6:
            return self.pose(node)
        if len(indices) > 2 or (is_p and self.scope.variable("p") is None):
            self.report(
                value,
                f"p[...] takes six numbers, not {len(indices)}"
                if is_p
                else f"an element has one or two indices, not {len(indices)}",
            )
            return at.constant(None)
        if array := self.built_in_array(value):
            return self.call_built_in(value, BUILT_IN_ARRAYS[array][0], indices)
        self.cost += 1
        function = "element" if len(indices) == 1 else "element_of_matrix"
        return at.call(function, self.value(value), *(self.value(index) for index in indices))

    def pose(self, node: tree.Index) -> ast.expr:
        """Translate a pose of six expressions."""
        at = AstBuilder.of(node.value)
        self.cost += 1
        values = [item.value for item in node.indices if isinstance(item, tree.Constant)]
        if len(values) == 6 and all(type(value) in NUMBERS for value in values):
            return at.name(self.keep(Pose(values)))
        return at.call("posed", at.tuple([self.value(item) for item in node.indices]))

    def built_in_array(self, node: tree.Expression) -> str | None:
        """Return the name of the controller's array that an expression refers to; None for other expressions."""
        if (
            isinstance(node, tree.Name)
            and node.name in BUILT_IN_ARRAYS
            and self.scope.variable(node.name) is None
        ):
            return node.name
        return None

    def call_built_in(self, node: tree.Node, name: str, arguments: Sequence[tree.Expression]) -> ast.expr:
        """Translate an access to an array of the controller, which is a call of a built-in function."""
        if name not in self.signatures:
            self.report(node, name_not_found(name))
            return AstBuilder.of(node).constant(None)
        given = [tree.Argument(argument.line, argument.column, None, argument) for argument in arguments]
        return self.call(tree.Call(node.line, node.column, name, given), built_in=True)

    def call(self, node: tree.Call, *, built_in: bool = False) -> ast.expr:
        """Translate a call; functions of the script hide those of the controller."""
        at = AstBuilder.of(node)
        self.cost += 1
        scope = None if built_in else self.scope.find(node.name)
        if node.name == "struct" and scope is None:
            return self.struct(node)
        if scope is not None:
            if scope.function.kind == "thread":
                self.report(node, f"{node.name} is a thread: write `run {node.name}()` to start it")
            parameters = [
                (parameter.name, MISSING if default is not None else None)
                for parameter, default in scope.function.parameters
            ]
            deeper = ast.BinOp(at.name(DEPTH), ast.Add(), at.constant(1), **at.given)
            return at.waiting(at.call(scope.code_name, deeper, *self.arguments(node, parameters)))
        signature = self.signatures.get(node.name)
        if signature is None:
            self.report(node, name_not_found(node.name))
            for argument in node.arguments:
                self.value(argument.value)
            return at.constant(None)
        self.used.add(node.name)
        self.cost += signature.cost - 1
        self.works = self.works or signature.linear
        known = [
            (parameter.name, None if parameter.default is REQUIRED else self.default(node.name, parameter))
            for parameter in signature.parameters
        ]
        call = at.call(f"b_{node.name}", *self.arguments(node, known))
        return at.waiting(call) if signature.blocks else call

    def arguments(self, node: tree.Call, parameters: list[tuple[str, str | None]]) -> list[ast.expr]:
        """Put a call's arguments into the order of the parameters, but compute them in the order of the text.

        A parameter is a tuple of its name and the name of its default, or None if it has none.
        """
        at = AstBuilder.of(node)
        given: dict[str, ast.expr] = {}
        names = [name for name, _ in parameters]
        known = set(names)
        for place, argument in enumerate(node.arguments):
            value = self.value(argument.value)
            name = argument.name
            if name is None:
                if place >= len(names):
                    limit = f"at most {_counted(len(names))}" if names else "no arguments"
                    self.report(argument, f"{node.name} takes {limit}, but {len(node.arguments)} are given")
                    return []
                if place and node.arguments[place - 1].name is not None:
                    self.report(argument, "an argument without a name follows one with a name")
                name = names[place]
            elif name not in known:
                self.report(argument, f"{node.name} has no parameter {name}")
                return []
            if name in given:
                self.report(argument, f"{node.name} is given {name} twice")
            given[name] = value
        for name, default in parameters:
            if name not in given:
                if default is None:
                    self.report(node, f"{node.name} needs a value for its parameter {name}")
                    return []
                given[name] = at.name(default)
        return _arranged(at, given, names)

    def run(self, node: tree.Call) -> ast.expr:
        """Translate the start of a thread."""
        at = AstBuilder.of(node)
        self.cost += START
        scope = self.scope.find(node.name)
        if scope is None and node.name not in self.signatures:
            self.report(node, name_not_found(node.name))
        elif scope is None or scope.function.kind != "thread":
            self.report(node, f"{node.name} is no thread: `run` starts what `thread` has defined")
        elif node.arguments:
            self.report(node, f"{node.name} is a thread, which takes no arguments")
        else:
            return at.call("run", at.name(scope.code_name))
        return at.constant(None)

    def struct(self, node: tree.Call) -> ast.expr:
        """Translate `struct(a=1, b=2)`."""
        at = AstBuilder.of(node)
        names = [argument.name for argument in node.arguments]
        if not 1 <= len(names) <= LONGEST:
            self.report(node, f"struct takes from 1 to {LONGEST} members, not {len(names)}")
        seen: set[str] = set()
        for argument in node.arguments:
            if argument.name is None:
                why = "struct needs a name for each member, as in struct(x=1)"
                self.report(argument, why)
            elif argument.name in seen:
                self.report(argument, f"struct is given {argument.name} twice")
            else:
                seen.add(argument.name)
        self.cost += len(names)
        values = at.tuple([self.value(argument.value) for argument in node.arguments])
        return at.call("structured", at.tuple([at.constant(name) for name in names]), values)

    def member(self, node: tree.Member) -> ast.expr:
        """Translate `a.name`."""
        self.cost += 1
        at = AstBuilder.of(node)
        return at.call("member", self.value(node.value), at.constant(node.name))

    def method(self, node: tree.Method) -> ast.expr:
        """Translate `a.name(arguments)`, which only the controller can evaluate."""
        at = AstBuilder.of(node)
        self.cost += 1 + len(node.arguments)
        value = self.value(node.value)
        arguments = at.tuple([self.value(argument.value) for argument in node.arguments])
        if METHOD not in self.signatures:
            self.report(node, name_not_found(f"{METHOD}{node.name}"))
            return at.constant(None)
        self.used.add(METHOD)
        return at.call(f"b_{METHOD}", value, at.constant(node.name), arguments)


def first(node: tree.Expression | tree.Step) -> tuple[int, int]:
    """Return line and column of the first token of an expression."""
    while True:
        if isinstance(node, tree.Binary):
            node = node.left
        elif isinstance(node, tree.Index | tree.Member | tree.Method):
            node = node.value
        else:
            return node.line, node.column


def _arranged(at: AstBuilder, given: dict[str, ast.expr], names: list[str]) -> list[ast.expr]:
    """Return the arguments in the order of the parameters; Python computes them in the given order."""
    if list(given) == names or all(isinstance(value, ast.Constant | ast.Name) for value in given.values()):
        return [given[name] for name in names]
    places = {name: place for place, name in enumerate(given)}
    order = at.tuple([at.constant(places[name]) for name in names])
    values = at.call("arranged", order, at.tuple(list(given.values())))
    return [ast.Starred(values, ast.Load(), **at.given)]


def _counted(number: int) -> str:
    return "1 argument" if number == 1 else f"{number} arguments"
