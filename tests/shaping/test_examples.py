"""The library's README and examples are right, run, and need nothing but numpy and the library."""

import ast
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests import forked

from tvist_shaping import SHAPERS, band

ROOT = Path(__file__).parents[2]
README = ROOT / "shaping" / "README.md"
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


def row(shaper):
    impulses = shaper.function(1.0, 0.0)
    low, high = band(impulses, 1.0, 0.0, 0.05)
    span = "–" if math.isnan(low) else f"{low:.3f}–{high:.3f}"
    times = f"{impulses.duration:.3g} | {impulses.mean_delay:.3g}"
    cells = f"{shaper.description} | {times} | {span} | {shaper.zeta_max:g}"
    return f"| `{shaper.name}` | {cells} |"


def test_readme_table_matches_the_catalogue():
    table = [line for line in README.read_text().splitlines() if line.startswith("| `")]
    assert table == [row(shaper) for shaper in SHAPERS.values()]


ALONE = """
import importlib.abc, sys
class Refusing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top not in {"numpy", "tvist_kernels", "tvist_shaping"} and top not in sys.stdlib_module_names:
            raise ImportError(f"{name} is not there")
sys.meta_path.insert(0, Refusing())
"""


def test_first_readme_example_needs_only_numpy_and_ten_lines(tmp_path):
    block = README.read_text().split("```pycon\n")[1].split("```")[0]
    example = [line[4:] for line in block.splitlines() if line.startswith((">>> ", "... "))]
    assert len(example) <= 10
    program = "\n".join([ALONE, f"sys.path = [{str(README.parent)!r}, *sys.path]", *example])
    command = [sys.executable, "-c", program]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert "%" in ended.stdout
