"""The server reads no wall clock, which somebody may set."""

import ast
from importlib.util import find_spec
from pathlib import Path

import pytest

LOOKS = {("time", name) for name in ("time", "time_ns", "localtime", "gmtime", "ctime", "strftime")} | {
    (module, name)
    for module in ("datetime", "date")
    for name in ("now", "today", "utcnow", "datetime", "date")
}
"""Functions and modules that read the wall clock."""


@pytest.mark.parametrize(
    "package",
    ["tvist_server", "tvist_controller", "tvist_plant", "tvist_shaping", "tvist_urscript", "tvist_protocol"],
)
def test_server_does_not_read_the_wall_clock(package):
    (folder,) = find_spec(package).submodule_search_locations
    for path in Path(folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            found = set()
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                found = {(node.value.id, node.attr)}
            elif isinstance(node, ast.ImportFrom):
                found = {(node.module, alias.name) for alias in node.names}
            assert not found & LOOKS, f"{path}:{node.lineno}"
