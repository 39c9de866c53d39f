"""What does not need a library does not import it."""

import subprocess
import sys

import pytest

import tvist_client

LOADED = """
import sys
{}
heavy = {{"msgspec", "zenoh", "asyncio", "numpy", "cyclopts", "rich"}}
print(*(heavy & set(sys.modules)), file=sys.stderr)
"""


@pytest.mark.parametrize(
    "does", ["import tvist_client", "sys.argv[1:] = ['--help']; from tvist_cli.main import main; main()"]
)
def test_the_package_and_the_list_of_commands_load_no_library(does):
    ended = subprocess.run(
        [sys.executable, "-c", LOADED.format(does)], check=True, capture_output=True, text=True
    )
    assert ended.stderr.split() == []


def test_each_name_of_the_client_is_there_when_it_is_used():
    assert dir(tvist_client) == sorted(tvist_client.__all__)
    assert all(getattr(tvist_client, name).__name__ == name for name in tvist_client.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Robo'"):
        tvist_client.Robo  # noqa: B018
