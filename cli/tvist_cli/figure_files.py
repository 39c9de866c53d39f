"""Options for figure files, the same on every command that writes figures."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cyclopts import Parameter

from tvist_cli.failure import Failure, Misuse, failing_on
from tvist_cli.output import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Save = Callable[["Figure", str], Path]
"""Writes a figure to a file of this name, given without suffix, and returns its path."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """How a command writes figures."""

    format: Literal["png", "pdf", "svg"] | None = None  # write figures as png, pdf or svg [png]
    style: list[str] | None = None
    """Draw figures in this style, repeatable: paper, with headings and explanations in a text file beside
    each; slides, with larger type; or a matplotlib style sheet FILE.mplstyle, which may also set colors,
    width and resolution."""

    @contextmanager
    def into(self, folder: Path) -> Iterator[Save]:
        """Set the style of figures for the body; yield the function that saves figures in the folder."""
        from tvist_lab.figures import house_style, save

        with house_style(*self.style or ()):
            yield lambda figure, name: save(figure, folder / f"{name}.{self.format or 'png'}")

    def write(self, folder: Path | None, draw: Callable[[], "Mapping[str, Figure]"]) -> None:
        """Unless `folder` is None, draw figures and write them there under their names."""
        if folder is not None:
            with self.into(folder) as save:
                write(save, draw())

    def check(self, folder: Path | None, *files: Path | None, option: str = "--figures") -> None:
        """Raise Failure, before anything is computed, if figures or other output files cannot be written as requested.

        `folder` and each of `files` is None if its option was not given; `option` is that of `folder`.
        """
        for file in files:
            if file is not None and not file.parent.is_dir():
                raise Failure(f"{file} cannot be written: there is no folder {file.parent}")
        for name in ("format", "style"):
            if folder is None and getattr(self, name) is not None:
                raise Misuse(f"--{name} is about figures: give {option} DIR too, or leave it out")
        if {"paper", "slides"} <= set(self.style or ()):
            raise Misuse("style is paper and slides: give one of them")
        if folder is not None and folder.exists() and not folder.is_dir():
            raise Failure(f"{folder} exists already and is no folder: choose another name")
        if self.style:
            from tvist_lab.figures import StyleError

            with failing_on(StyleError, exit_code=2), self.into(Path()):
                pass


DEFAULT_FIGURES = FigureOptions()


def write(save: Save, figures: "Mapping[str, Figure]") -> None:
    """Write figures under these names, without suffix, and print the path of each."""
    for name, figure in figures.items():
        say(str(save(figure, name)))
