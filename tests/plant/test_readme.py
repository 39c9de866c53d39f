import doctest
from pathlib import Path

README = Path(__file__).parents[2] / "sim_plant" / "README.md"


def test_the_examples_print_what_they_say():
    results = doctest.testfile(str(README), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0
