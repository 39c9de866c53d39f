"""Tools with arguments describe them."""

import pytest
from tests.conformance.served import finished


@pytest.mark.parametrize("tool", ["executed", "mutants", "stubs", "tables"])
def test_help_of_each_tool_names_its_arguments(tool):
    ended = finished("-m", f"tools.{tool}", "--help")
    assert (ended.returncode, "Usage: " in ended.stdout) == (0, True), ended.stderr
