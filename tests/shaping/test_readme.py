import math
import subprocess
import sys
from pathlib import Path

from tvist_shaping import SHAPERS, band

README = Path(__file__).parents[2] / "shaping" / "README.md"


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


def first_example():
    """What the first block of code of the README is, without its prompts."""
    block = README.read_text().split("```pycon\n")[1].split("```")[0]
    return "\n".join(line[4:] for line in block.splitlines() if line.startswith((">>> ", "... ")))


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
    example = first_example()
    assert len(example.splitlines()) <= 10
    package = README.parent / "tvist_shaping"
    path = f"sys.path = [{str(package.parent)!r}, *sys.path]\n"
    ended = subprocess.run(
        [sys.executable, "-c", ALONE + path + example],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert ended.returncode == 0, ended.stderr
    assert "%" in ended.stdout
