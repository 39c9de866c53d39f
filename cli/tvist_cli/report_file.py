"""The web page that a command writes about its result."""

from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.output import say

if TYPE_CHECKING:
    from tvist_lab.report import Page


def write_report(path: Path, page: "Page") -> None:
    """Write a page, all of it or nothing, and say where it is."""
    from tvist_lab.report import render
    from tvist_lab.whole_file import whole_file

    with whole_file(path) as stream:
        stream.write(render(page).encode())
    say(f"the report is in {path}")
