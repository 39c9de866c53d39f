"""Find errors in a script without running it."""

import re
from collections.abc import Iterator
from dataclasses import fields

from tvist_urscript import tree
from tvist_urscript.compiler import program_of, translate
from tvist_urscript.errors import ScriptError
from tvist_urscript.names import scopes
from tvist_urscript.signatures import Signatures


def check(text: str, signatures: Signatures) -> list[ScriptError]:
    """Return the errors of a script in the order of the text; an empty list if it can run.

    If the syntax is wrong, the only error is at the first token that does not fit. Else the errors are all
    unknown names, and all calls that do not fit their functions.
    """
    return translate(text, signatures)[1]


def unportable(text: str) -> list[ScriptError]:
    """Return what a real UR robot would refuse in a script that has no errors here."""
    program, *inner = scopes(program_of(text))
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
            try:
                parse("\n".join([*lines[begun:number], ""]))
            except ScriptError:
                why = "a robot of UR's that gets this text takes it to end here, at an end in column 1"
                return [ScriptError(number, 1, f"{why}: indent what is inside")]
            begun = number
    return []
