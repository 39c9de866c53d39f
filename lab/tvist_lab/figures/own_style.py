"""A style file of matplotlib, whose settings take precedence over those of the house, for all figures of a process."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.font_manager import FontProperties

SUFFIX = ".mplstyle"
"""End of the name of a style file."""
LEFT_OUT = (
    "axes.prop_cycle", "backend", "figure.dpi", "interactive", "lines.color", "lines.linestyle",
    "lines.marker", "lines.markersize", "savefig.bbox", "savefig.directory", "savefig.format", "toolbar",
)  # fmt: skip
"""Settings that a figure here has from elsewhere: what a curve is determines its colour and dashes, and an option the
format."""

RANGES = {"figure.figsize": (2.0, 40.0), "savefig.dpi": (30.0, 2400.0)}
"""Least and largest width [inch] and resolution [dots per inch] that a file may set."""

_OWN: dict[str, Any] = {}


class StyleError(ValueError):
    """A style file cannot be used; the message says why."""


def own() -> Mapping[str, Any]:
    """Return the settings of the style file that is used; empty without one."""
    return _OWN


def use(path: Path) -> tuple[str, ...]:
    """Use a style file for all figures that are drawn from now on.

    Returns:
        Those of its settings that have no effect here; none if it is used already.

    Raises:
        StyleError: It cannot be read, or has a setting that matplotlib does not know, or a wrong value.
    """
    found = _read(path)
    for name, (least, most) in RANGES.items():
        value = found.get(name, "figure")
        if value != "figure" and not least <= (number := float(np.ravel(value)[0])) <= most:
            raise StyleError(f"style {path} sets {name} to {number:g}: must be {least:g} to {most:g}")
    if found.get("text.usetex") and shutil.which("latex") is None:
        raise StyleError(f"style {path} sets text.usetex, which needs LaTeX: there is no program latex")
    kept = {name: value for name, value in found.items() if name not in LEFT_OUT}
    settings: Any = mpl.rcParams
    settings.update(kept)
    # A size may be a word, which is relative to font.size.
    sizes = {name: FontProperties(size=value).get_size_in_points()
             for name, value in kept.items() if name.endswith("size") and isinstance(value, str)}  # fmt: skip
    known = kept | sizes == _OWN
    _OWN.clear()
    _OWN.update(kept | sizes)
    return () if known else tuple(sorted(found.keys() - kept.keys()))


def _read(path: Path) -> dict[str, Any]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StyleError(
            f"style {path} cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    for number, line in enumerate(lines, 1):
        name, colon, _ = line.partition("#")[0].partition(":")
        if name.strip() and not (colon and name.strip() in mpl.rcParams):
            raise StyleError(f"style {path}, line {number}: {name.strip()!r} is no setting of matplotlib")
    try:
        found: Any = mpl.rc_params_from_file(path, fail_on_error=True, use_default_template=False)
    except ValueError as error:
        raise StyleError(f"style {path}: {' '.join(str(error).split())}") from error
    return dict(found)
