"""A figure as journals print it: headings and explanations become its caption, and colours differ in grey."""

import string
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from tvist_lab.figures.style import IN_PRINT, tint, title

COLORS = {
    to_hex(old): new for old, new in [*IN_PRINT.items(), *((tint(o), tint(n)) for o, n in IN_PRINT.items())]
}
"""Colours and their tints to what is printed instead."""
COLORED = ("color", "facecolor", "edgecolor", "markerfacecolor", "markeredgecolor")
"""Properties that are colours."""


def for_print(figure: Figure) -> str:
    """Take headings and explanations out of a figure; several panels with headings are named by letters.

    Returns:
        What was taken out, as a caption; symbols are as in TeX.
    """
    headed = [panel for panel in figure.axes if panel.get_title(loc="left")]
    said = []
    for letter, panel in zip(string.ascii_lowercase, headed, strict=False):
        words = " ".join(panel.get_title(loc="left").split())
        said.append(f"{letter}: {words}." if len(headed) > 1 else f"{words}.")
        title(panel, letter if len(headed) > 1 else "")
    for box in filter(is_below, list(figure.legends)):
        said += [f"{' '.join(text.get_text().split())}." for text in box.get_texts()]
        box.remove()
    for artist in figure.findobj():
        for name in COLORED:
            _recolor(artist, name)
    return " ".join(said)


def is_below(box: Legend) -> bool:
    """Return whether a legend lies below the panels and holds explanations."""
    return "lower" in str(box._outside_loc)  # type: ignore[attr-defined]  # noqa: SLF001  not public


def _recolor(artist: Any, name: str) -> None:
    """Exchange a colour of an artist, or those of its parts."""
    color = getattr(artist, f"get_{name}", lambda: "none")()
    parts = [color] if isinstance(color, str) or np.ndim(color) == 1 else list(color)
    printed = [COLORS.get(to_hex(part)) if len(part) else None for part in parts]
    if any(printed):
        new = [one or part for one, part in zip(printed, parts, strict=True)]
        getattr(artist, f"set_{name}")(new if len(new) > 1 else new[0])
