"""`python -m tools.stubs`: writes what editors and type checkers read of methods that exist only at run time.

These are the commands of the client, and its classes without `await`. Runs in a checkout.
"""

import inspect
import re
import subprocess
import sys
from inspect import formatannotation
from pathlib import Path
from textwrap import fill
from types import ModuleType

from tvist_client import blocking, commands, waiting
from tvist_client.command import Answer, Sent
from tvist_protocol.commands import Command

HEAD = """# fmt: off
# Made by `make schemas`.

from typing import Any, Literal, Optional, Self, Union
"""
NAME = re.compile(r"(?<![\w.'\"])((?:[a-z]\w*\.)+)(\w+)")
"""A name with its module."""


def generated() -> dict[Path, str]:
    """Return the text of each file."""
    return {Path(module.__file__ or "").with_suffix(".pyi"): _stub(module) for module in (commands, blocking)}


def _stub(module: ModuleType) -> str:
    here = [
        kind for kind in vars(module).values() if inspect.isclass(kind) and kind.__module__ == module.__name__
    ]
    text = "\n\n".join(map(_class, here)).replace(
        formatannotation(Command), "tvist_protocol.commands.Command"
    )
    text = text.replace(formatannotation(Answer), "tvist_client.command.Answer")
    imports = {f"from {place[:-1]} import {name}\n" for place, name in NAME.findall(text)}
    imports -= {f"from {kind.__module__} import {kind.__name__}\n" for kind in here}
    exported = f"__all__ = {module.__all__}\n" if hasattr(module, "__all__") else ""
    lines = "".join(map(_filled, NAME.sub(r"\2", text).splitlines()))
    return _sorted(HEAD + "".join(imports) + "\n" + exported + "\n" + lines)


def _class(kind: type) -> str:
    bases = ", ".join(f"{base.__module__}.{base.__qualname__}" for base in kind.__bases__)
    lines = [f"class {kind.__name__}({bases}):".replace("(builtins.object)", "")]
    for name, member in vars(kind).items():
        if isinstance(member, Sent | waiting.Waited):
            start = "async def" if isinstance(member, Sent) else "def"
            lines.append(f"    {start} {name}{inspect.signature(member)}: ...")
        elif isinstance(member, waiting.Attribute):
            lines.append(f"    {name}: {formatannotation(member.kind)}")
    return "\n".join(lines)


def _filled(line: str) -> str:
    """Break a line before parameters."""
    whole = re.sub(r"(?<!,) | (?!\w+: |\*,)", "\0", line)
    return fill(whole, 110, subsequent_indent=" " * 8).replace("\0", " ") + "\n"


def _sorted(text: str) -> str:
    """Sort the imports, and leave out those that are not used."""
    command = [
        sys.executable,
        "-m",
        "ruff",
        "check",
        "--fix",
        "--exit-zero",
        "--quiet",
        "--select",
        "F401,I,Q000,UP007,UP045",
        "--stdin-filename",
        "stub.pyi",
        "-",
    ]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    for path, text in generated().items():
        path.write_text(text, encoding="utf-8")
