import doctest
import math
from pathlib import Path

from tvist_shaping import SHAPERS, band

README = Path(__file__).parents[2] / "shaping" / "README.md"


def test_the_examples_print_what_they_say():
    results = doctest.testfile(str(README), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0


def row(shaper):
    impulses = shaper.function(1.0, 0.0)
    low, high = band(impulses, 1.0, 0.0, 0.05)
    span = "–" if math.isnan(low) else f"{low:.3f} – {high:.3f}"
    cells = f"{shaper.description} | {impulses.duration:g} T | {impulses.mean_delay:g} T | {span}"
    return f"| `{shaper.name}` | {cells} |"


def test_the_table_of_shapers_is_the_catalogue_as_computed():
    table = [line for line in README.read_text().splitlines() if line.startswith("| `")]
    assert table == [row(shaper) for shaper in SHAPERS.values()]
