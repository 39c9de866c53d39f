"""A self-contained web page: text, tables and pictures in one file that loads nothing."""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from tvist_lab.figures.files import fit

DPI = 110
"""Resolution of pictures [dpi]; a figure's 183 mm are 793 pixels."""


@dataclass(frozen=True)
class PageTable:
    """A table; the first column is text, the others are numbers as text."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture in the page itself."""

    source: str
    """A `data:` address."""
    caption: str
    """What it shows, also for those who cannot see it."""


@dataclass(frozen=True)
class Section:
    """A heading with what belongs to it, in this order."""

    heading: str
    text: Sequence[str] = ()
    """Paragraphs."""
    tables: Sequence[PageTable] = ()
    pictures: Sequence[Picture] = ()
    points: Sequence[str] = ()
    """Items of a list."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """Words and what they mean or are."""


@dataclass(frozen=True)
class Page:
    """A report."""

    title: str
    verdict: Sequence[str]
    """Sentences that answer the reader's question; the first alone is enough."""
    sections: Sequence[Section]


def picture(figure: Figure, caption: str) -> Picture:
    """Put a figure into the page as PNG."""
    fit(figure, 2)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI, metadata={"Software": None})
    return Picture("data:image/png;base64," + base64.b64encode(stream.getvalue()).decode(), caption)


def render(page: Page) -> str:
    """Return the page as HTML. Equal pages give equal text; there is no date in it."""
    environment = Environment(
        loader=PackageLoader("tvist_lab.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template("page.html.j2").render(page=page, version=version("tvist"))
