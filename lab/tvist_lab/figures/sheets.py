"""Style sheets and files of figures."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib import resources
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

STYLES = ("paper", "slides")
"""Style sheets besides the default: `paper` moves text to a file beside figures, `slides` has larger type."""
SUFFIX = ".mplstyle"
RANGES = {"figure.figsize": (2.0, 40.0), "savefig.dpi": (30.0, 2400.0)}
"""Range of width [inch] and resolution [dots per inch] in a style sheet."""
WIDTH, COLUMN = 183.0 / 25.4, 89.0 / 25.4  # width of two columns of a journal, and of one [inch]
NOT_OF_STYLE = ("backend", "interactive", "savefig.directory", "savefig.format", "toolbar")
"""Settings of the drawing program rather than of its figures."""
SMALLER = 0.8  # size of text and lines for one column, relative to that for two [-]
SIZES = ("font.size", "lines.linewidth", "lines.markersize")  # settings to which all other sizes are relative
STABLE: dict[str, dict[str, Any]] = {
    ".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}
}  # fmt: skip
"""Metadata without date and program version, so that equal figures give equal files."""
in_print: ContextVar[bool] = ContextVar("in_print", default=False)
"""Whether figures have no headings and explanations, because a caption holds them."""


class StyleError(ValueError):
    """A style sheet cannot be used; the message tells why."""


@contextmanager
def house_style(*styles: str) -> Iterator[None]:
    """Draw and save figures in the given styles: any of `STYLES`, or paths of style sheets; later ones win.

    Raises StyleError if a style is unknown, unreadable, or has a wrong setting.
    """
    settings: Any = house_settings(*styles)
    before = in_print.set("paper" in styles)
    try:
        with mpl.rc_context(settings):
            yield
    finally:
        in_print.reset(before)


def house_settings(*styles: str) -> dict[str, Any]:
    """Return matplotlib's settings of `house_style`, for a notebook that keeps one style."""
    settings, own = _shipped("house"), dict[str, Any]()
    for style in styles:
        if style in STYLES:
            settings |= _shipped(style)
        elif style.endswith(SUFFIX):
            own |= _read(Path(style))
        else:
            raise StyleError(
                f"style is {style!r}: must be {', '.join(STYLES)} or a file that ends in {SUFFIX}"
            )
    settings |= own
    # Text shrinks less than a narrow figure, to stay readable; a user's sheet may fix its size.
    narrow = np.interp(settings["figure.figsize"][0], (COLUMN, WIDTH), (SMALLER, 1.0))
    for name in SIZES:
        settings[name] *= 1.0 if "font.size" in own else float(narrow)
    return settings


def _read(path: Path) -> dict[str, Any]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StyleError(
            f"style {path} cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    for place, line in enumerate(lines, 1):
        name, colon, _ = line.partition("#")[0].partition(":")
        if name.strip() and not (colon and name.strip() in mpl.rcParams):
            raise StyleError(f"style {path}, line {place}: {name.strip()!r} is no setting of matplotlib")
    try:
        found: Any = mpl.rc_params_from_file(path, fail_on_error=True, use_default_template=False)
    except ValueError as error:
        raise StyleError(f"style {path}: {' '.join(str(error).split())}") from error
    for name, (least, most) in RANGES.items():
        value = found.get(name, "figure")
        if value != "figure" and not least <= (number := float(np.ravel(value)[0])) <= most:
            raise StyleError(f"style {path} sets {name} to {number:g}: must be {least:g} to {most:g}")
    if found.get("text.usetex") and shutil.which("latex") is None:
        raise StyleError(f"style {path} sets text.usetex, which needs LaTeX: there is no program latex")
    return {name: value for name, value in found.items() if name not in NOT_OF_STYLE}


def _shipped(name: str) -> dict[str, Any]:
    with resources.as_file(resources.files(__package__) / f"{name}{SUFFIX}") as path:
        found: Any = mpl.rc_params_from_file(path, use_default_template=False)
    return dict(found)


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure in the format of the suffix, create missing folders, and return the path.

    In the style `paper`, headings and explanations are written beside it, as NAME.txt.
    """
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    if in_print.get():
        file.with_suffix(".txt").write_text(f"{caption(figure)}\n", encoding="utf-8")
    figure.savefig(file, metadata=STABLE.get(file.suffix))
    return file


def headed(figure: Figure | SubFigure) -> list[Axes]:
    """Return panels whose heading is invisible, but stored as label; labels of colour bars start with "<"."""
    return [panel for panel in figure.axes if not str(panel.get_label() or "<").startswith("<")]


def caption(figure: Figure) -> str:
    """Return headings and explanations of a figure; letters name panels if several have headings."""
    headings = [str(panel.get_label()) for panel in headed(figure)]
    if len(headings) > 1:
        headings = [f"{letter}: {words}" for letter, words in zip(ascii_lowercase, headings, strict=False)]
    said = [" ".join(words.split()) for words in (*headings, str(figure.get_label())) if words]
    return " ".join(f"{words.removesuffix('.')}." for words in said)
