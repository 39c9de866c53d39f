"""A self-contained web page: text, tables and pictures in one file that loads nothing."""

import base64
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

DPI = 138
"""Resolution of pictures [dpi]; a figure's 183 mm are the 994 pixels to which the page grows."""


@dataclass(frozen=True)
class PageTable:
    """A table; the first column is text, the others are numbers as text.

    The second line of a head or of a cell is small: a symbol, a unit, an interval.
    """

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
    explains: bool = False
    """Whether the facts are what words in the heads of tables mean, which then lead to them."""


@dataclass(frozen=True)
class Page:
    """A report."""

    title: str
    verdict: Sequence[str]
    """Sentences that answer the reader's question; the first alone is enough."""
    sections: Sequence[Section]


def picture(figure: Figure, caption: str) -> Picture:
    """Put a figure into the page as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI, metadata={"Software": None})
    return Picture("data:image/png;base64," + base64.b64encode(stream.getvalue()).decode(), caption)


def render(page: Page) -> str:
    """Return the page as HTML. Equal pages give equal text; there is no date in it."""
    environment = Environment(
        loader=PackageLoader("tvist_lab.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["symbols"] = _symbols
    words = [word for section in page.sections if section.explains for word in section.facts]
    places = {word: f"word-{number}" for number, word in enumerate(words, 1)}
    heads = {head for section in page.sections for table in section.tables for head in table.columns}
    explained = {head: places[word] for head in heads if (word := _word(head, words))}
    template = environment.get_template("page.html.j2")
    return template.render(page=page, version=version("tvist"), places=places, explained=explained)


def _symbols(words: str) -> Markup:
    """Words of which the index of a symbol is below the line: f_d, t_stb."""
    return Markup(re.sub(r"\b([a-zA-Z])_([a-z]+)\b", r"\1<sub>\2</sub>", str(escape(words))))  # noqa: S704  escaped


def _word(head: str, words: Sequence[str]) -> str:
    """The longest word with which a head begins; empty if there is none."""
    return max((word for word in words if head.startswith(word)), key=len, default="")
