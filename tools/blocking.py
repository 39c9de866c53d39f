"""`python -m tools.blocking`: writes the classes of the client without `await` from those of the client with it.

Each public method becomes one that waits, with the same arguments and description. Runs in a checkout.
"""

import ast
import inspect
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import indent

from tvist_client import arm, motion, robot, servo, stepper

PATH = Path(robot.__file__).with_name("blocking_classes.py")
HEAD = '''"""The classes of the client without `await`; `tvist_client.blocking` opens and closes the connection.

Made by `python -m tools.blocking` from the classes of the client with `await`: change those instead.
"""

import contextlib
from collections.abc import Iterator
from typing import Self
from tvist_client import arm, motion, robot, servo, stepper
from tvist_client.blocking_stream import Stream
from tvist_client.portal import Portal
from tvist_client.published import BUFFER
from tvist_client.robot import ANSWER_S
'''
LEFT_OUT: dict[type, set[str]] = {
    motion.Motion: {"on_event", "fail", "wait_event"},
    servo.Servo: {"check"},
    stepper.Stepper: set(),
    arm.Arm: {"keep_alive_every"},
    robot.Robot: {"connect", "over", "close", "pass_time", "put_setpoint", "until", "watch", "clock_token"},
}
"""The classes, and of each what is for other modules of the client, or written by hand."""
WRAPPED = {of.__name__ for of in LEFT_OUT}
Member = ast.FunctionDef | ast.AsyncFunctionDef | ast.AnnAssign


def generated() -> str:
    """Return the text of the module."""
    imports = {line for of in LEFT_OUT for part in _parts(of) for line in _imports(part)}
    text = HEAD + "\n".join(sorted(imports)) + "".join(map(_class, LEFT_OUT))
    short = "lint.isort.split-on-trailing-comma=false"
    return _ruff(_ruff(text, "check", "--fix", "--quiet", "--select", "F401,I", "--config", short), "format")


def _class(of: type) -> str:
    name, inner = of.__name__, of.__module__.rpartition(".")[2]
    description = _described((inspect.getdoc(of) or "").partition("\n\nArgs:")[0])
    takes = f"def __init__(self, portal: Portal, {inner}: {inner}.{name}) -> None"
    methods = [f"{takes}:\n    self._portal, self._{inner} = portal, {inner}\n"]
    for member, what in _members(of):
        head, body = _waiting(member, name, f"self._{inner}.")
        methods.append(f"{head}:\n{_described(what)}{indent(body, '    ')}\n")
    return f"\n\nclass {name}:\n{description}\n" + indent("\n".join(methods), "    ")


def _waiting(member: Member, owner: str, inner: str) -> tuple[str, str]:
    """Return the head and the body of a method that has a member of the class with `await` do the work."""
    if isinstance(member, ast.AnnAssign):
        name = ast.unparse(member.target)
        return f"@property\ndef {name}(self) -> {ast.unparse(member.annotation)}", f"return {inner}{name}"
    decorators = {ast.unparse(one).rpartition(".")[2] for one in member.decorator_list}
    arguments, returned = member.args, ast.unparse(member.returns or ast.Constant(None)).strip("'")
    passed = [one.arg for one in arguments.args[1:]] + [
        f"{one.arg}={one.arg}" for one in arguments.kwonlyargs
    ]
    call = f"{inner}{member.name}({', '.join(passed)})"
    waited = f"self._portal.call(lambda: {call})" if passed else f"self._portal.call({inner}{member.name})"
    before = ""
    if "property" in decorators:
        before, body = "@property\n", f"return {inner}{member.name}"
    elif "asynccontextmanager" in decorators:
        before, returned = "@contextlib.contextmanager\n", returned.removeprefix("Async")
        kind = returned.removeprefix("Iterator[").removesuffix("]")
        body = f"with self._portal.enter({call}) as entered:\n    yield {kind}(self._portal, entered)"
    elif returned == owner:
        returned, body = "Self", f"{waited}\nreturn self"
    elif returned in WRAPPED:
        body = f"return {returned}(self._portal, {waited})"
    elif isinstance(member, ast.AsyncFunctionDef):
        body = waited if returned == "None" else f"return {waited}"
    elif returned.startswith("Stream["):
        body = f"return Stream(self._portal, self._portal.run(lambda: {call}))"
    else:
        runs = "subscription" if returned == "Callable[[], None]" else "run"
        body = f"return self._portal.{runs}(lambda: {call})"
    return f"{before}def {member.name}({ast.unparse(arguments)}) -> {returned}", body


def _members(of: type) -> Iterator[tuple[Member, str]]:
    """Public methods, properties and described attributes of a class and its bases, with their descriptions."""
    seen = set(LEFT_OUT[of])
    for part in _parts(of):
        (tree,) = ast.parse(inspect.getsource(part)).body
        assert isinstance(tree, ast.ClassDef)
        for node, following in zip(tree.body, [*tree.body[1:], None], strict=True):
            if isinstance(node, ast.AnnAssign) and isinstance(following, ast.Expr):
                name, what = ast.unparse(node.target), ast.literal_eval(following.value)
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                name, what = node.name, ast.get_docstring(node) or ""
            else:
                continue
            if name not in seen and not name.startswith("_"):
                yield node, what
            seen.add(name)


def _described(text: str) -> str:
    text = text.replace("async with", "with")
    return indent(f'"""{text}' + ('\n"""\n' if "\n" in text else '"""\n'), "    ")


def _parts(of: type) -> list[type]:
    return [part for part in of.__mro__ if part.__module__.startswith("tvist_client.")]


def _imports(of: type) -> set[str]:
    """Lines that import what the signatures of a class may name; those in excess are removed afterwards."""
    nodes = ast.parse(Path(inspect.getfile(of)).read_text(encoding="utf-8")).body
    found = {
        (node.module, one.name) for node in nodes if isinstance(node, ast.ImportFrom) for one in node.names
    }
    return {f"from {module} import {name}" for module, name in found if name not in WRAPPED | {"Stream"}}


def _ruff(text: str, *words: str) -> str:
    command = [sys.executable, "-m", "ruff", *words, "--stdin-filename", str(PATH), "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    PATH.write_text(generated(), encoding="utf-8")
