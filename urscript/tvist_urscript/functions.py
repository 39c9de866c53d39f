"""Translate functions of a script to Python's generator functions."""

import ast

from tvist_urscript import tree
from tvist_urscript.errors import Fault
from tvist_urscript.failures import TooDeep
from tvist_urscript.names import Scope
from tvist_urscript.pieces import DEPTH, MISSING, assign, branch, call, charge, compare, located, name
from tvist_urscript.statements import Statements

DEEPEST_CALLS = 200  # most nested calls of functions
MOST_PARAMETERS = 255  # most parameters of one function
MOST_FUNCTIONS = 2000  # most functions and threads of a program
MOST_STATEMENTS = 4000
"""Most statements of one function; while Python compiles a function, no other thread of the process runs."""
MOST_NODES = 10_000  # most operations, names, calls and statements of one function, for the same reason
PART, PART_NODES = 200, 1000
"""Most statements, and most nodes (counted as for MOST_NODES), in each part of a long main function."""


def too_deep() -> None:
    """End the program if calls are nested too deep."""
    raise TooDeep(f"functions are called more than {DEEPEST_CALLS} deep")


def fail(why: str) -> None:
    """End the program at a call that can only fail."""
    raise Fault(why)


class Functions(Statements):
    """Translates functions of a script, and splits a long main function."""

    def function(self, scope: Scope) -> list[ast.FunctionDef]:
        """Translate a function of the script, without those inside it.

        A long main function becomes several; this is possible because all its variables are global.
        """
        function = scope.function
        self.scope = scope
        if scope.outer is not None and function.kind == "sec":
            self.report(function, "only a whole program can be a sec")
        for twice in scope.twice:
            self.report(twice, f"{twice.name} is defined twice")
        if scope.outer is not None or (_length(function.body) <= PART and _size(function.body) <= PART_NODES):
            return [self.definition(scope.code_name, function, function.body)]
        self.is_part = True
        parts = [
            self.definition(f"{scope.code_name}_{number}", function, body)
            for number, body in enumerate(_parts(function.body))
        ]
        self.is_part = False
        calls: list[ast.stmt] = [
            branch(ast.YieldFrom(call(part.name, name(DEPTH))), [ast.Return(ast.Constant(None))])
            for part in parts
        ]
        return [*parts, _definition(function, scope.code_name, [], calls)]

    def definition(self, title: str, function: tree.Function, body: list[tree.Statement]) -> ast.FunctionDef:
        """Translate a function, or a part of the main function, to a function of Python."""
        size = _size(body) + sum(default.size for _, default in function.parameters if default is not None)
        for count, most, what in (
            (_length(body), MOST_STATEMENTS, "statements"),
            (size, MOST_NODES, "operations and names"),
        ):
            if count > most:
                many = f"{count} {what} of {function.name} are too many in one function"
                self.report(function, f"{many}: the limit is {most}")
                return _definition(function, title, [], [])
        self.globals, self.loops = set(), 0
        parameters = self.parameters(function)
        defaults: list[ast.stmt] = []
        for parameter, default in function.parameters:
            if default is not None:
                variable = f"v_{parameter.name}"
                missing = compare(name(variable), ast.Is(), name(MISSING))
                defaults.append(located(branch(missing, [assign(variable, self.value(default))]), parameter))
        too_deep = branch(
            compare(name(DEPTH), ast.Gt(), ast.Constant(DEEPEST_CALLS)), [ast.Expr(call("too_deep"))]
        )
        statements, _ = self.block(body, 0)
        declared: list[ast.stmt] = [ast.Global(sorted(self.globals))] if self.globals else []
        begun = [*declared, *charge(1 + len(defaults), check=True), too_deep, *defaults]
        return _definition(function, title, parameters, begun + statements)

    def parameters(self, function: tree.Function) -> list[str]:
        """Check the parameters of a function and return their names in Python."""
        names: dict[str, None] = {}
        needed = True
        if (count := len(function.parameters)) > MOST_PARAMETERS:
            many = f"{count} parameters of {function.name} are too many"
            self.report(function, f"{many}: the limit is {MOST_PARAMETERS}")
            return []
        for parameter, default in function.parameters:
            if function.kind == "thread":
                self.report(parameter, f"the thread {function.name} cannot have parameters")
            if f"v_{parameter.name}" in names:
                self.report(parameter, f"the parameter {parameter.name} is named twice")
            if default is None and not needed:
                self.report(parameter, f"the parameter {parameter.name} needs a default as the one before it")
            needed = needed and default is None
            names[f"v_{parameter.name}"] = None
        return list(names)


def _definition(at: tree.Node, name: str, parameters: list[str], body: list[ast.stmt]) -> ast.FunctionDef:
    given = ast.arguments([], [ast.arg(one) for one in (DEPTH, *parameters)], None, [], [], None, [])
    return ast.fix_missing_locations(located(ast.FunctionDef(name, given, body or [ast.Pass()], []), at))


def _length(body: list[tree.Statement]) -> int:
    """Return the number of statements including nested ones, but without those of inner functions."""
    total = 0
    waiting = [body]
    while waiting:
        for statement in waiting.pop():
            total += not isinstance(statement, tree.Function)
            if isinstance(statement, tree.While):
                waiting.append(statement.body)
            elif isinstance(statement, tree.If):
                waiting += [branch for _, branch in statement.branches]
                waiting.append(statement.otherwise)
                total += len(statement.branches)
    return total


def _size(body: list[tree.Statement]) -> int:
    return sum(statement.size for statement in body if not isinstance(statement, tree.Function))


def _parts(body: list[tree.Statement]) -> list[list[tree.Statement]]:
    parts: list[list[tree.Statement]] = [[]]
    length = size = 0
    for statement in body:
        own, more = _length([statement]), _size([statement])
        if (length + own > PART or size + more > PART_NODES) and parts[-1]:
            parts.append([])
            length = size = 0
        parts[-1].append(statement)
        length += own
        size += more
    return parts
