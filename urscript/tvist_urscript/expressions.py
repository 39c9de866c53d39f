"""Translate expressions of a script to Python's.

Arithmetic becomes calls of functions that check the operands; comparisons become Python's own.
"""

import ast
from collections.abc import Callable, Sequence

from tvist_urscript import tree
from tvist_urscript.errors import name_not_found
from tvist_urscript.names import BUILT_IN_ARRAYS, METHOD, Scope
from tvist_urscript.pieces import DEPTH, LOAD, MISSING, call, compare, invert, located, name
from tvist_urscript.signatures import REQUIRED, Signatures
from tvist_urscript.values import LONGEST, NUMBERS, Array, Pose

MOST_OPERATIONS = 1000  # most evaluations of one statement, since nothing can interrupt it
START = 20  # cost of starting a thread, which limits how many threads start in a tick

ARITHMETIC = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "%": "remainder"}
COMPARISONS: dict[str, type[ast.cmpop]] = {
    "<": ast.Lt, ">": ast.Gt, "<=": ast.LtE, ">=": ast.GtE, "==": ast.Eq, "!=": ast.NotEq
}  # fmt: skip
EQUALITY = {"==": "is_equal", "!=": "is_unequal"}
"""Functions of a machine that compare lists, which costs more."""

Report = Callable[[tree.Node, str], None]


class MisfitError(Exception):
    """A call cannot work, for a reason that may be at one of its arguments; the program fails when it reaches it."""

    def __init__(self, at: tree.Node, why: str) -> None:
        super().__init__(why)
        self.at, self.why = at, why


class Expressions:
    """Translates expressions, and reports errors, which prevent the start, and warnings."""

    def __init__(self, signatures: Signatures, report: Report, warn: Report) -> None:
        self.signatures = signatures
        self.report, self.warn = report, warn
        self.scope: Scope  # names that the function being translated can use
        self.cost = 0  # evaluations of the code translated since this was reset
        self.works = False  # whether code translated since the reset may work on lists, which costs more
        self.used: set[str] = set()  # built-in functions that the script calls
        self.constants: dict[str, object] = {}  # lists and default values, by their names in compiled code

    def value(self, node: tree.Expression) -> ast.expr:  # noqa: C901  one for each kind of node
        """Translate an expression whose value is needed."""
        made: ast.expr
        match node:
            case tree.Constant():
                made = ast.Constant(node.value)
            case tree.Name():
                made = self.name(node)
            case tree.Binary():
                made = self.binary(node)
            case tree.Call():
                made = self.run(node) if node.runs else self.call(node)
            case tree.Index():
                made = self.index(node)
            case tree.Member():
                self.cost += 1
                made = call("member", self.value(node.value), ast.Constant(node.name))
            case tree.Method():
                made = self.method(node)
            case tree.Listing():
                made = self.listing(node)
            case tree.Unary(operator="-"):
                self.cost += 1
                self.works = True
                made = call("negate", self.value(node.value))
            case tree.Unary():
                made = invert(self.test(node.value))
            case tree.Logic():
                made = invert(invert(self.test(node)))
        return located(made, node)

    def test(self, node: tree.Expression) -> ast.expr:
        """Translate an expression of which only the truth value is needed."""
        made: ast.expr
        match node:
            case tree.Logic(operator="xor"):
                made = invert(self.test(node.values[0]))
                self.cost += len(node.values) - 1
                for value in node.values[1:]:
                    made = invert(compare(made, ast.NotEq(), invert(self.test(value))))
                made = invert(made)
            case tree.Logic():
                self.cost += len(node.values) - 1
                operator = ast.And() if node.operator == "and" else ast.Or()
                made = ast.BoolOp(operator, [self.test(value) for value in node.values])
            case tree.Unary(operator="not"):
                self.cost += 1
                made = invert(self.test(node.value))
            case _:
                return self.value(node)
        return located(made, node)

    def name(self, node: tree.Name) -> ast.expr:
        variable = self.scope.variable(node.name)
        if variable is None:
            known = node.name in self.signatures
            hint = f" {node.name} is a function: call it" if known else self.scope.hint(node.name)
            self.report(node, name_not_found(node.name) + hint)
        return located(name(f"v_{node.name}" if variable == "local" else f"g_{node.name}"), node)

    def binary(self, node: tree.Binary) -> ast.expr:
        self.cost += 1
        left, right = self.value(node.left), self.value(node.right)
        constant = isinstance(node.left, tree.Constant) or isinstance(node.right, tree.Constant)
        function = ARITHMETIC.get(node.operator) or (None if constant else EQUALITY.get(node.operator))
        if function is None:
            return compare(left, COMPARISONS[node.operator](), right)
        self.works = True
        return call(function, left, right)

    def listing(self, node: tree.Listing) -> ast.expr:
        """Translate a list; a list of constants is created only once."""
        if len(node.items) > LONGEST:
            self.report(node, f"a list of {len(node.items)} elements is too long: the limit is {LONGEST}")
            return ast.Constant(None)
        values = [item.value for item in node.items if isinstance(item, tree.Constant)]
        if len(values) == len(node.items):
            return name(self.keep(Array(values)))
        self.cost += len(node.items)
        return call("listed", self.items(node.items))

    def items(self, nodes: Sequence[tree.Expression]) -> ast.Tuple:
        return ast.Tuple([self.value(node) for node in nodes], LOAD)

    def keep(self, value: object) -> str:
        """Store a value that compiled functions use; return the name under which they find the value."""
        name = f"c{self.scope.number}_{len(self.constants)}"
        self.constants[name] = value
        return name

    def index(self, node: tree.Index) -> ast.expr:
        """Translate access to an element, or a pose, which is `p[...]` with six expressions."""
        value, indices = node.value, node.indices
        is_p = isinstance(value, tree.Name) and value.name == "p"
        if is_p and len(indices) == 6:
            return located(self.pose(indices), value)
        if len(indices) > 2 or (is_p and self.scope.variable("p") is None):
            what = "p[...] takes six numbers" if is_p else "an element has one or two indices"
            self.report(value, f"{what}, not {len(indices)}")
            return ast.Constant(None)
        if array := self.built_in_array(value):
            return self.call_built_in(value, BUILT_IN_ARRAYS[array][0], indices)
        self.cost += 1
        function = "element" if len(indices) == 1 else "element_of_matrix"
        return located(call(function, *map(self.value, (value, *indices))), first(indices[0]))

    def pose(self, numbers: list[tree.Expression]) -> ast.expr:
        self.cost += 1
        values = [item.value for item in numbers if isinstance(item, tree.Constant)]
        if len(values) == 6 and all(type(value) in NUMBERS for value in values):
            return name(self.keep(Pose(values)))
        return call("posed", self.items(numbers))

    def built_in_array(self, node: tree.Expression) -> str | None:
        """Return the name of the controller's array that an expression refers to; None for other expressions."""
        if isinstance(node, tree.Name) and self.scope.variable(node.name) is None:
            return node.name if node.name in BUILT_IN_ARRAYS else None
        return None

    def call_built_in(self, node: tree.Node, name: str, arguments: Sequence[tree.Expression]) -> ast.expr:
        """Translate an access to an array of the controller, which is a call of a built-in function."""
        if name not in self.signatures:
            self.report(node, name_not_found(name))
            return ast.Constant(None)
        given = [tree.Argument(argument.line, argument.column, None, argument) for argument in arguments]
        return located(self.call(tree.Call(node.line, node.column, name, given), built_in=True), node)

    def call(self, node: tree.Call, *, built_in: bool = False) -> ast.expr:
        """Translate a call; one that cannot work fails when the program reaches it."""
        try:
            return self.working_call(node, built_in=built_in)
        except MisfitError as misfit:
            return self.failing(misfit.at, misfit.why)

    def failing(self, at: tree.Node, why: str) -> ast.expr:
        """Warn of a call that cannot work, and translate it to one that ends the program."""
        self.warn(at, why)
        return located(call("fail", ast.Constant(why)), at)

    def working_call(self, node: tree.Call, *, built_in: bool) -> ast.expr:
        """Translate a call; a function of the script hides the controller's function of the same name."""
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
            deeper = ast.BinOp(name(DEPTH), ast.Add(), ast.Constant(1))
            return ast.YieldFrom(call(scope.code_name, deeper, *self.arguments(node, parameters)))
        signature = self.signatures.get(node.name)
        if signature is None or signature.fails:
            for argument in node.arguments:
                self.value(argument.value)
            if signature is not None:
                raise MisfitError(node, f"{node.name}: {signature.fails}")
            self.report(node, name_not_found(node.name))
            return ast.Constant(None)
        self.used.add(node.name)
        self.cost += signature.cost - 1
        self.works = self.works or signature.linear
        known: list[tuple[str, str | None]] = []
        for parameter in signature.parameters:
            default = None if parameter.default is REQUIRED else f"d_{node.name}_{parameter.name}"
            known.append((parameter.name, default))
            if default is not None:
                self.constants[default] = parameter.default
        made = call(f"b_{node.name}", *self.arguments(node, known))
        return ast.YieldFrom(made) if signature.blocks else made

    def arguments(self, node: tree.Call, parameters: list[tuple[str, str | None]]) -> list[ast.expr]:
        """Return a call's arguments in the parameters' order; they are computed in the order of the text.

        A parameter is a tuple of its name and the name of its default, or None if it has none.

        Raises:
            MisfitError: There are too many arguments, or a parameter without default gets none.
        """
        given: dict[str, ast.expr] = {}
        names = [name for name, _ in parameters]
        values = [self.value(argument.value) for argument in node.arguments]
        for place, (argument, value) in enumerate(zip(node.arguments, values, strict=True)):
            parameter = argument.name
            if parameter is None:
                if place >= len(names):
                    counted = "1 argument" if len(names) == 1 else f"{len(names)} arguments"
                    limit = f"at most {counted}" if names else "no arguments"
                    raise MisfitError(
                        argument, f"{node.name} takes {limit}, but {len(node.arguments)} are given"
                    )
                if place and node.arguments[place - 1].name is not None:
                    self.report(argument, "an argument without a name follows one with a name")
                parameter = names[place]
            elif parameter not in names:
                self.report(argument, f"{node.name} has no parameter {parameter}")
                return []
            if parameter in given:
                self.report(argument, f"{node.name} is given {parameter} twice")
            given[parameter] = value
        for parameter, default in parameters:
            if parameter not in given:
                if default is None:
                    raise MisfitError(node, f"{node.name} needs a value for its parameter {parameter}")
                given[parameter] = name(default)
        return _arranged(given, names)

    def run(self, node: tree.Call) -> ast.expr:
        """Translate the start of a thread."""
        self.cost += START
        scope = self.scope.find(node.name)
        if scope is None and node.name not in self.signatures:
            self.report(node, name_not_found(node.name))
        elif scope is None or scope.function.kind != "thread":
            self.report(node, f"{node.name} is no thread: `run` starts what `thread` has defined")
        elif node.arguments:
            self.report(node, f"{node.name} is a thread, which takes no arguments")
        else:
            return call("run", name(scope.code_name))
        return ast.Constant(None)

    def struct(self, node: tree.Call) -> ast.expr:
        """Translate `struct(a=1, b=2)`."""
        names = [argument.name for argument in node.arguments]
        if not 1 <= len(names) <= LONGEST:
            self.report(node, f"struct takes from 1 to {LONGEST} members, not {len(names)}")
        seen: set[str] = set()
        for argument in node.arguments:
            if argument.name is None:
                self.report(argument, "struct needs a name for each member, as in struct(x=1)")
            elif argument.name in seen:
                self.report(argument, f"struct is given {argument.name} twice")
            else:
                seen.add(argument.name)
        self.cost += len(names)
        values = self.items([argument.value for argument in node.arguments])
        return call("structured", ast.Tuple([ast.Constant(name) for name in names], LOAD), values)

    def method(self, node: tree.Method) -> ast.expr:
        """Translate `a.name(arguments)`, which only the controller can evaluate."""
        self.cost += 1 + len(node.arguments)
        value = self.value(node.value)
        arguments = self.items([argument.value for argument in node.arguments])
        if METHOD not in self.signatures:
            self.report(node, name_not_found(f"{METHOD}{node.name}"))
        elif why := self.signatures[METHOD].fails:
            return self.failing(node, f"{node.name}: {why}")
        self.used.add(METHOD)
        return call(f"b_{METHOD}", value, ast.Constant(node.name), arguments)


def first(node: tree.Expression | tree.Step) -> tree.Node:
    """Return the innermost part of an expression that begins with the expression's first token."""
    while True:
        if isinstance(node, tree.Binary):
            node = node.left
        elif isinstance(node, tree.Index | tree.Member | tree.Method):
            node = node.value
        else:
            return node


def _arranged(given: dict[str, ast.expr], names: list[str]) -> list[ast.expr]:
    """Return arguments in the order of `names`; the code computes them in the order of `given`."""
    if list(given) == names or all(isinstance(one, ast.Constant | ast.Name) for one in given.values()):
        return [given[parameter] for parameter in names]
    places = {parameter: place for place, parameter in enumerate(given)}
    order = ast.Tuple([ast.Constant(places[parameter]) for parameter in names], LOAD)
    return [ast.Starred(call("arranged", order, ast.Tuple(list(given.values()), LOAD)), LOAD)]
