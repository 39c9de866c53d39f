"""Options about the files of figures, the same on every command that writes some."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_lab.figures import FigureFiles


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """How a command writes figures."""

    format: Literal["png", "pdf", "svg"] | None = None
    """Format of figures: png, pdf or svg [png]."""
    style: list[str] | None = None
    """Style of figures, repeatable: paper, with headings and explanations in a text beside each; slides, with larger
    type; or a style file of matplotlib, FILE.mplstyle, which may also set width and resolution."""

    def into(self, folder: Path) -> "FigureFiles":
        """Return the folder together with what was asked for."""
        from tvist_lab.figures import FigureFiles
        from tvist_lab.figures.files import STYLES

        self.check(folder)
        style = next((one for one in self.style or () if one in STYLES), "")
        return FigureFiles(folder, self.format or "png", style)

    def check(self, folder: Path | None, *files: Path | None) -> None:
        """Refuse what cannot be done, before anything is computed.

        Args:
            folder: Value of --figures; None where it was not given.
            files: Other files that will be written at the end; None for those that were not given.

        Raises:
            Failure: There is no such style, there are no figures to which an option could apply, or a file's folder
                does not exist.
        """
        for file in files:
            if file is not None and not file.parent.is_dir():
                raise Failure(f"{file} cannot be written: there is no folder {file.parent}")
        for name in ("format", "style"):
            if folder is None and getattr(self, name) is not None:
                raise Failure(f"--{name} is about figures: give --figures DIR too, or leave it out", code=2)
        if {"paper", "slides"} <= set(self.style or ()):
            raise Failure("style is paper and slides: give one of them", code=2)
        for style in self.style or ():
            _check_style(style)
        if folder is not None and folder.exists() and not folder.is_dir():
            raise Failure(f"{folder} exists already and is no folder: choose another name")


def _check_style(style: str) -> None:
    """Refuse what is no style; a style file is used from now on."""
    from tvist_lab.figures.files import STYLES
    from tvist_lab.figures.own_style import SUFFIX, StyleError, use

    if style in STYLES:
        return
    if not style.endswith(SUFFIX):
        raise Failure(
            f"style is {style!r}: must be {', '.join(STYLES)} or a file that ends in {SUFFIX}", code=2
        )
    with told(StyleError, code=2):
        idle = use(Path(style))
    if idle:
        say(f"{style}: no effect here have {', '.join(idle)}: tvist or its options set them")


AS_USUAL = FigureOptions()
"""Nothing was asked for."""


def write(files: "FigureFiles", figures: "Mapping[str, Figure]") -> None:
    """Write figures and say the path of each.

    Args:
        files: Where to, and how.
        figures: Name of the file, without its suffix, to the figure.
    """
    for name, figure in figures.items():
        say(str(files.write(figure, name)))
