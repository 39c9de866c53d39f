"""What the server promises: behind every sentence stands a test that is there."""

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "explanations" / "promises.md"
TEST = re.compile(r"`(?P<path>[\w/]+\.py)::(?P<name>[\w:]+)`")


def promises():
    """The items of the page's lists, each with the lines below it."""
    text = PAGE.read_text(encoding="utf-8")
    sections = text.split("\n## ")[1:]
    return [item for section in sections for item in re.findall(r"^- .*(?:\n  .*)*", section, re.MULTILINE)]


def names_in(path):
    """Names of the tests of a file, those of a class behind its name."""
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        members = node.body if isinstance(node, ast.ClassDef) else [node]
        prefix = f"{node.name}::" if isinstance(node, ast.ClassDef) else ""
        found |= {prefix + member.name for member in members if isinstance(member, FUNCTIONS)}
    return found


FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def test_every_promise_names_a_test():
    assert len(promises()) > 20
    assert not [promise for promise in promises() if not TEST.search(promise)]


def test_every_test_that_is_named_is_there():
    named = TEST.findall(PAGE.read_text(encoding="utf-8"))
    assert not [f"{path}::{name}" for path, name in named if name not in names_in(TESTS / path)]


def test_every_test_of_faults_stands_behind_a_promise():
    named = set(TEST.findall(PAGE.read_text(encoding="utf-8")))
    faults = [*(TESTS / "system").glob("test_faults*.py"), *(TESTS / "system").glob("test_deadman*.py")]
    there = {(f"system/{path.name}", name) for path in faults for name in names_in(path)}
    assert {(path, name) for path, name in there if name.rpartition(":")[2].startswith("test_")} <= named
