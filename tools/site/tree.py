"""Which files become pages of the site: what the front page and the index reach, at the paths of the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
HOME = ROOT / "README.md"
INDEX = ROOT / "docs" / "README.md"

CODE = re.compile(r"^(?P<indent> *)```.*?^(?P=indent)```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
"""Fenced blocks and spans of code."""
LINK = re.compile(r"""(?:(?<=\]\()|(?<= src=")|(?<= srcset="))(?P<target>[^)"\s]+)(?=[)"])""")
"""Targets of links and images; images also in HTML."""
OUTSIDE = ("http://", "https://", "mailto:")


class LinkError(ValueError):
    """A page links to something that is not there, or that is outside the repository."""


def links(text: str) -> list[re.Match[str]]:
    """Return the links and images of a page that are not code, each a match with a group `target`."""
    code = [match.span() for match in CODE.finditer(text)]
    return [
        match
        for match in LINK.finditer(text)
        if not any(start <= match.start() < end for start, end in code)
        and not match["target"].startswith(OUTSIDE)
    ]


def linked(page: Path, target: str) -> Path:
    """Return the file or folder that a link of a page leads to; a folder with a README is that README."""
    path = (page.parent / target).resolve() if target else page
    if not path.is_relative_to(ROOT) or not path.exists():
        raise LinkError(f"{page.relative_to(ROOT)} links to {target}, which is no file of the repository")
    return path / "README.md" if (path / "README.md").exists() else path


def collect() -> tuple[list[Path], list[Path]]:
    """Return what the front page and the index reach over any number of links: pages, and all other files."""
    pages, others, waiting = {HOME, INDEX}, set[Path](), [HOME, INDEX]
    while waiting:
        page = waiting.pop()
        for match in links(page.read_text(encoding="utf-8")):
            path = linked(page, match["target"].partition("#")[0])
            if path.suffix != ".md":
                others.add(path)
            elif path not in pages:
                pages.add(path)
                waiting.append(path)
    return sorted(pages), sorted(others)
