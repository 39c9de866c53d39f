"""Find errors in a script without running it."""

import re
from collections.abc import Iterator
from dataclasses import fields
from typing import NamedTuple

from tvist_urscript import tree
from tvist_urscript.compiler import program_of, translate
from tvist_urscript.errors import ScriptError
from tvist_urscript.names import scopes
from tvist_urscript.signatures import Signatures


class Findings(NamedTuple):
    """What needs attention in a script, in the order of the text."""

    errors: list[ScriptError]  # a script with errors cannot run
    warnings: list[ScriptError]


def check(text: str, signatures: Signatures) -> Findings:
    """Return the errors and warnings of a script.

    If the syntax is wrong, the only error is at the first token that does not fit. Else the errors are
    unknown names, and arguments that name no parameter, name one twice, or follow a named one without a name.
    Warnings are calls that fail when the program reaches them, since the function is not
    simulated or the arguments do not fit; and, if there are no errors, constructs that a UR robot rejects or
    reads differently, and a text that only defines functions.
    """
    try:
        program = program_of(text)
    except ScriptError as error:
        return Findings([error], [])
    script, errors, warnings = translate(text, program, signatures)
    if script is not None:
        warnings += _unportable(text, program)
        if script.idle:
            why = "the text only defines functions: as a program, it ends at once"
            warnings.append(ScriptError(1, 1, why))
    return Findings(errors, sorted(warnings, key=lambda warning: (warning.line, warning.column)))


def _unportable(text: str, root: tree.Function) -> list[ScriptError]:
    """Return what a real UR robot would refuse in a script that has no errors here."""
    program, *inner = scopes(root)
    assigned = [node for node in _nodes(program.function) if isinstance(node, tree.Assign)]
    own = program.globals - {node.target.name for node in assigned if node.qualifier == "global"}
    found = _framed_short(text)
    for scope in inner:
        left = own - scope.assigned - scope.local if scope.function.kind == "thread" else set()
        for node in _nodes(*scope.function.body):
            if isinstance(node, tree.Name) and node.name in left:
                left.remove(node.name)
                why = f"{node.name}: a robot of UR's does not find this variable in the thread {scope.function.name}"
                why += ": write global before its first assignment"
                found.append(ScriptError(node.line, node.column, why))
    return found


def _nodes(*roots: object) -> Iterator[tree.Node]:
    """Yield nodes and all nodes below them, in the order of the text."""
    waiting = list(reversed(roots))
    while waiting:
        one = waiting.pop()
        if isinstance(one, tree.Node):
            yield one
            waiting += [getattr(one, field.name) for field in reversed(fields(one))]
        elif isinstance(one, list | tuple):
            waiting += reversed(one)


def _framed_short(text: str) -> list[ScriptError]:
    """Return the first `end` in column 1 that ends an inner block: on real robots, the program ends there."""
    from tvist_urscript.parsing import parse

    lines, begun = text.split("\n"), 0
    for number, line in enumerate(lines, 1):
        if re.match(r"end\b", line):
            if begun == 0 and not any(lines[number:]):
                return []  # the piece is the whole text, which has no errors
            try:
                parse("\n".join([*lines[begun:number], ""]))
            except ScriptError:
                why = "a robot of UR's that gets this text takes it to end here, at an end in column 1"
                return [ScriptError(number, 1, f"{why}: indent what is inside")]
            begun = number
    return []
