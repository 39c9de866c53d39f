"""The first example uses no tvist package, and the client imports no library before it needs one."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tvist_client

EXAMPLE = Path(__file__).parents[2] / "clients/examples/01_bare_client.py"
LOADED = """
import sys
{}
heavy = {{"msgspec", "zenoh", "asyncio", "numpy", "cyclopts", "rich"}}
print(*(heavy & set(sys.modules)), file=sys.stderr)
"""


def test_the_bare_client_interpolates_the_delay_and_imports_no_tvist_package(monkeypatch):
    """That it runs against a robot is the system's test."""
    monkeypatch.setattr("sys.argv", ["01_bare_client.py"])
    spec = importlib.util.spec_from_file_location("bare_client", EXAMPLE)
    bare = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bare)
    t = np.arange(5000) * bare.TICK
    reference = [bare.swing(x) for x in t]
    for lag in (1.0, 10.04, 80.9):
        target = [bare.swing(max(0.0, x - lag * bare.TICK)) for x in t]
        assert bare.delay(reference, target) == pytest.approx(lag, abs=0.02)
    imported = re.findall(r"^\s*(?:import|from) (\w+)", EXAMPLE.read_text(), re.MULTILINE)
    assert not [name for name in imported if name.startswith("tvist")]
    assert {"msgpack", "zenoh"} <= set(imported)


@pytest.mark.parametrize(
    "does", ["import tvist_client", "sys.argv[1:] = ['--help']; from tvist_cli.main import main; main()"]
)
def test_importing_the_client_and_listing_commands_load_no_library(does):
    command = [sys.executable, "-c", LOADED.format(does)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True)
    assert ended.stderr.split() == []


def test_every_exported_name_of_the_client_can_be_used():
    assert dir(tvist_client) == sorted(tvist_client.__all__)
    assert all(getattr(tvist_client, name).__name__ == name for name in tvist_client.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Robo'"):
        tvist_client.Robo  # noqa: B018
