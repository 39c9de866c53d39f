"""`tvist lesson`: open a page for trying out input shaping."""

import os
import sys
import webbrowser
from importlib.resources import files
from pathlib import Path

from tvist_cli.output import out


def lesson() -> None:
    """Open a page for trying out shaping: a mass on a spring, an arm that folds, a shaper of your own, a UR5e.

    The page is one file that computes in the browser, without server or network. The command prints its path,
    so that you can copy it.
    """
    page = Path(str(files("tvist_view").joinpath("try.html")))
    out.print(f"the page is the file {page}: open it in any browser, or copy it to wherever it is wanted")
    graphical = sys.platform in {"darwin", "win32"} or bool(
        {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    )
    if graphical:  # elsewhere a browser in the terminal would open, which draws nothing
        webbrowser.open(page.as_uri())
