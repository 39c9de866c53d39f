"""`tvist lesson`: a page on which to try shaping."""

import os
import sys
import webbrowser
from importlib.resources import files
from pathlib import Path

from tvist_cli.output import out


def lesson() -> None:
    """Open a page on which to try shaping: a mass on a spring, an arm that folds, a shaper of your own, a UR5e.

    The page is one file that computes in the browser, without a server or a network; the command says where it is, to
    be copied.
    """
    page = Path(str(files("tvist_view").joinpath("try.html")))
    out.print(f"the page is the file {page}: open it in any browser, or copy it to wherever it is wanted")
    graphical = sys.platform in {"darwin", "win32"} or bool(
        {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    )
    if graphical:  # elsewhere a browser in the terminal would open, which draws nothing
        webbrowser.open(page.as_uri())
