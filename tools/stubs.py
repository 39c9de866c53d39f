"""Stubs of the client's methods that exist only at run time, for editors and type checkers."""

import inspect
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from inspect import formatannotation
from pathlib import Path
from textwrap import fill, indent
from types import ModuleType

from cyclopts import run

import tvist_client
from tvist_client import blocking, commands
from tvist_client.command import Answer, Sent
from tvist_client.waiting import Attribute, BlockingMethod
from tvist_protocol.commands import Command

PACKAGE = Path(tvist_client.__file__).parent
MODULES = (commands, blocking)
HEAD = """# fmt: off
# Made by `make schemas`.

from typing import Any, Literal, Optional, Self, Union
"""
NAME = re.compile(r"(?<![\w.'\"])((?:[a-z]\w*\.)+)(\w+)")  # a name with its module


def generated() -> dict[Path, str]:
    """Return the text of each file."""
    return {PACKAGE / f"{module.__name__.rpartition('.')[2]}.pyi": _stub(module) for module in MODULES}


def main(folder: Path | None = None) -> None:
    """Write the stubs into this checkout.

    Args:
        folder: Instead write into this folder a copy of the client that contains the methods with
            their docstrings, from which the documentation site is made.
    """
    if folder is None:
        for path, text in generated().items():
            path.write_text(text, encoding="utf-8")
        return
    copy = folder / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("*.pyi", "__pycache__"))
    for module in MODULES:
        text = f'"""{module.__doc__}"""\n' + _stub(module, described=True)
        (copy / f"{module.__name__.rpartition('.')[2]}.py").write_text(text, encoding="utf-8")


def _stub(module: ModuleType, *, described: bool = False) -> str:
    here = [kind for kind in vars(module).values() if getattr(kind, "__module__", "") == module.__name__]
    parts = [part for kind in here for part in _parts(kind)]
    imports = {
        f"from {place[:-1]} import {name}\n" for text, _ in parts for place, name in NAME.findall(text)
    }
    imports -= {f"from {kind.__module__} import {kind.__name__}\n" for kind in here}
    exported = f"__all__ = {module.__all__}\n" if hasattr(module, "__all__") else ""
    lines = (_written(NAME.sub(r"\2", text), doc if described else None) for text, doc in parts)
    return _sorted(HEAD + "".join(imports) + "\n" + exported + "".join(lines))


def _parts(kind: type) -> Iterator[tuple[str, str]]:
    """Yield the header of a class, then its members, each with its docstring."""
    bases = [f"{base.__module__}.{base.__qualname__}" for base in kind.__bases__ if base is not object]
    yield f"class {kind.__name__}({', '.join(bases)}):".replace("()", ""), kind.__doc__ or ""
    for name, member in vars(kind).items():
        if isinstance(member, Sent | BlockingMethod):
            signature = str(inspect.signature(member)).replace(
                formatannotation(Answer), "tvist_client.command.Answer"
            )
            signature = signature.replace(formatannotation(Command), "tvist_protocol.commands.Command")
            start = "async def" if isinstance(member, Sent) else "def"
            yield f"    {start} {name}{signature}:", member.__doc__
        elif isinstance(member, Attribute):
            yield f"    {name}: {formatannotation(member.kind)}", member.__doc__


def _written(head: str, doc: str | None) -> str:
    """Format a class, method or attribute header with its docstring; wrap long headers before parameters."""
    is_class, is_method = head.startswith("class "), head.endswith(":") and head.startswith(" ")
    whole = re.sub(r"(?<!,) | (?!\w+: |\*,)", "\0", head + " ..." * (is_method and doc is None))
    text = "\n" * is_class + fill(whole, 110, subsequent_indent=" " * 8).replace("\0", " ") + "\n"
    if doc is not None:
        text += indent(f'r"""{inspect.cleandoc(doc)}\n"""\n', "    " * (1 + is_method))
    return text


def _sorted(text: str) -> str:
    """Sort the imports, and remove unused ones."""
    words = "check --fix --exit-zero --quiet --select F401,I,Q000,UP007,UP045 --stdin-filename stub.pyi -"
    command = [sys.executable, "-m", "ruff", *words.split()]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    run(main)
