"""Self-contained web pages: text, tables and pictures in one file that loads nothing."""

import base64
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

DPI = 138  # resolution of pictures [dpi]; a figure's 183 mm are the 994 pixels to which the page grows


@dataclass(frozen=True)
class PageTable:
    """A table; the first column is text, the others are numbers as text.

    The second line of a head or cell is small, for a symbol, a unit or an interval.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture inside the page."""

    source: str
    """A `data:` address."""
    caption: str
    """Description, also for those who cannot see the picture."""


@dataclass(frozen=True)
class Section:
    """A heading and its content, in this order."""

    heading: str
    text: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    pictures: Sequence[Picture] = ()
    points: Sequence[str] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    """Terms with their meanings or values."""
    explains: bool = False
    """Whether the facts explain words in table heads, which then link to them."""


@dataclass(frozen=True)
class ReportPage:
    """A report."""

    title: str
    verdict: Sequence[str]
    """Sentences that answer the reader's question; the first alone is enough."""
    sections: Sequence[Section]


def picture(figure: Figure, caption: str) -> Picture:
    """Embed a figure as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI, metadata={"Software": None})
    return Picture("data:image/png;base64," + base64.b64encode(stream.getvalue()).decode(), caption)


def render(page: ReportPage) -> str:
    """Render a page as HTML; equal pages give equal text, without a date."""
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
    """Set the index of symbols such as f_d and t_stb as subscript."""
    return Markup(re.sub(r"\b([a-zA-Z])_([a-z]+)\b", r"\1<sub>\2</sub>", str(escape(words))))  # noqa: S704  escaped


def _word(head: str, words: Sequence[str]) -> str:
    """Return the longest word with which a head starts; empty if there is none."""
    return max((word for word in words if head.startswith(word)), key=len, default="")
