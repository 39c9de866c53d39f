"""The library's examples run, and need nothing but numpy and the library."""

import ast
import re
import sys
from pathlib import Path

import pytest
from tests import forked

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "shaping" / "examples"
PAGE = ROOT / "docs" / "explanations" / "one-flexible-joint.md"
EXAMPLES = sorted(FOLDER.glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example_imports_only_numpy_and_the_library(example):
    imported = set()
    for node in ast.walk(ast.parse(example.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {name.name.partition(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module.partition(".")[0])
    assert imported == {"numpy", "tvist_shaping"}


def test_one_joint_example_shows_that_zv_needs_the_right_frequency():
    ended = forked.run(
        [sys.executable, FOLDER / "one_joint.py"], capture_output=True, text=True, check=True, timeout=300
    )
    left = {
        name.strip(): float(percent)
        for name, percent in re.findall(r"^(.*?) +[\d.]+ mrad, +([\d.]+) %$", ended.stdout, re.MULTILINE)
    }
    assert left["unshaped"] == 100.0
    assert left["ZV for 90°"] > 15.0
    assert left["TVIST"] < 4.0
    assert ended.stdout in PAGE.read_text(encoding="utf-8")
