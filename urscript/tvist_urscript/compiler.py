"""Compile a script's tree to Python code: one generator function for each function of the script."""

import ast
import re
from collections.abc import Iterator
from types import CodeType, MappingProxyType
from typing import NamedTuple

from tvist_urscript import tree
from tvist_urscript.errors import ScriptError, no_program, syntax_error
from tvist_urscript.failures import FILE
from tvist_urscript.functions import MOST_FUNCTIONS, Functions
from tvist_urscript.names import outline, scopes
from tvist_urscript.script import Script
from tvist_urscript.signatures import Signatures


def compile_script(text: str, signatures: Signatures, after: Script | None = None) -> Script:
    """Compile a program: a `def` or `sec` with its `end`, or statements and functions as in a Script node.

    Args:
        text: The script as it was sent.
        signatures: The built-in functions of the controller; the language's own are known.
        after: Program, or the last statements added to it, to which the text is added (see `Machine.add`).
            The text may then consist of statements and functions, and use everything defined before.

    Raises:
        ScriptError: The first error in the order of the text.
    """
    program = program_of(text) if after is None else _statements(text)
    script, errors, _ = translate(text, program, signatures, after)
    if errors:
        raise errors[0]
    assert script is not None
    return script


class Translation(NamedTuple):
    """A compiled program; errors, and calls that fail when they are reached, are in the order of the text."""

    script: Script | None  # None if there are errors
    errors: list[ScriptError]
    warnings: list[ScriptError]


def translate(
    text: str, program: tree.Function, signatures: Signatures, after: Script | None = None
) -> Translation:
    """Compile a program, given as text and tree."""
    from tvist_urscript.library import PURE

    known = {**{name: entry[0] for name, entry in PURE.items()}, **signatures}
    errors: set[tuple[int, int, str]] = set()
    warnings: set[tuple[int, int, str]] = set()
    found = scopes(program) if after is None else scopes(program, after.scope, after.scopes)
    if len(found) > MOST_FUNCTIONS:
        head = found[MOST_FUNCTIONS].function
        why = f"a program of {len(found)} functions is too long: the limit is {MOST_FUNCTIONS}"
        return Translation(None, [ScriptError(head.line, head.column, why)], [])
    translator = Functions(
        known,
        report=lambda at, why: errors.add((at.line, at.column, why)),
        warn=lambda at, why: warnings.add((at.line, at.column, why)),
    )
    trees = [made for scope in found for made in translator.function(scope)]
    late = [ScriptError(*one) for one in sorted(warnings)]
    if errors:
        return Translation(None, [ScriptError(*one) for one in sorted(errors)], late)
    script = Script(
        program.name,
        program.kind == "sec",
        text,
        found[0].code_name,
        tuple(map(_code, trees)),
        MappingProxyType(translator.constants),
        frozenset(translator.used),
        outline(found[0]),
        found[0].number + len(found),
        bool(program.body) and all(isinstance(one, tree.Function) for one in program.body),
        frozenset(line for scope in found for line in _last_lines(scope.function.body)),
    )
    return Translation(script, [], late)


def program_of(text: str) -> tree.Function:
    """Return a script's tree: its `def` or `sec`, or its statements as one function."""
    statements = _parsed(text)
    head = statements[0]
    if not isinstance(head, tree.Function) or not (
        len(statements) == 1 or _is_called_alone(head, statements)
    ):
        return _together(text, statements)
    if head.kind == "thread":
        raise no_program(head, "a thread must be inside a program")
    if head.parameters:
        name, _ = head.parameters[0]
        raise ScriptError(name.line, name.column, f"the program {head.name} cannot have parameters")
    return head


def _is_called_alone(head: tree.Function, statements: list[tree.Statement]) -> bool:
    """Whether only a call of `head` follows its `def`, as in post-processors' programs for sockets."""
    match statements[1:]:
        case [tree.Evaluate(value=tree.Call(name=name, arguments=[], runs=False))]:
            return head.kind == "def" and name == head.name and not head.parameters
        case _:
            return False


def _statements(text: str) -> tree.Function:
    statements = _parsed(text, several=True)
    for statement in statements:
        if isinstance(statement, tree.Function) and statement.kind == "sec":
            raise ScriptError(statement.line, statement.column, "only a whole program can be a sec")
    return _together(text, statements)


def _parsed(text: str, *, several: bool = False) -> list[tree.Statement]:
    from tvist_urscript.parsing import parse  # loads the parser library, so only when needed

    statements = parse(text, several=several)
    if not statements:
        raise ScriptError(1, 1, syntax_error(1, "the text has no statement"))
    return statements


def _together(text: str, statements: list[tree.Statement]) -> tree.Function:
    """Make a program of statements. Its name is that of the last function among them, else the first word."""
    head = statements[0]
    names = [statement.name for statement in statements if isinstance(statement, tree.Function)]
    word = re.search(r"^[ \t]*([A-Za-z_]\w*)", text, re.MULTILINE)
    name = names[-1] if names else word[1] if word else "program"
    return tree.Function(head.line, head.column, "def", name, [], statements)


def _last_lines(body: list[tree.Statement]) -> Iterator[int]:
    """Yield the last lines of a function, after which it does nothing more."""
    for statement in reversed(body):
        match statement:
            case tree.Function() | tree.Label() | tree.Return(value=None) | tree.Word(word="halt" | "pass"):
                continue
            case tree.If():
                for _, branch in statement.branches:
                    yield from _last_lines(branch)
                yield from _last_lines(statement.otherwise)
            case _:
                yield statement.line
        return


def _code(made: ast.FunctionDef) -> CodeType:
    """Compile one function, separately from others, so that the interpreter's lock is held only briefly."""
    module = compile(ast.Module([made], []), FILE, "exec", dont_inherit=True, optimize=0)
    return next(constant for constant in module.co_consts if isinstance(constant, CodeType))
