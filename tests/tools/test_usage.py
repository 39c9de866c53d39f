"""Tools with arguments describe them."""

import runpy
import sys

import pytest


@pytest.mark.filterwarnings("ignore:Cyclopts application invoked without tokens")
@pytest.mark.parametrize("tool", ["executed", "mutants", "stubs", "tables"])
def test_help_of_each_tool_names_its_arguments(tool, monkeypatch, capsys):
    name = f"tools.{tool}"
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    monkeypatch.delitem(sys.modules, name, raising=False)
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(name, run_name="__main__")
    assert ended.value.code in (None, 0)
    assert "Usage: " in capsys.readouterr().out
