"""Find the pages of the site: all that the front page and the index reach, at their paths in the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
HOME = ROOT / "README.md"
INDEX = ROOT / "docs" / "README.md"

CODE = re.compile(r"^(?P<indent> *)```.*?^(?P=indent)```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
"""Fenced blocks and spans of code."""
LINK = re.compile(r"""(?:(?<=\]\()|(?<= src=")|(?<= srcset="))(?P<target>[^)"\s]+)(?=[)"])""")
"""Targets of links and images, also of images in HTML."""
OUTSIDE = ("http://", "https://", "mailto:")


class LinkError(ValueError):
    """A page links to a file that does not exist or is outside the repository."""


def links(text: str) -> list[re.Match[str]]:
    """Return the links and images of a page, except in code, as matches with a group `target`."""
    code = [match.span() for match in CODE.finditer(text)]
    return [
        match
        for match in LINK.finditer(text)
        if not any(start <= match.start() < end for start, end in code)
        and not match["target"].startswith(OUTSIDE)
    ]


def linked(page: Path, target: str) -> Path:
    """Return the file or folder that a link leads to; for a folder with a README, the README."""
    path = (page.parent / target).resolve() if target else page
    if not path.is_relative_to(ROOT) or not path.exists():
        raise LinkError(f"{page.relative_to(ROOT)} links to {target}, which is no file of the repository")
    return path / "README.md" if (path / "README.md").exists() else path


def collect() -> tuple[list[Path], list[Path]]:
    """Return the pages and the other files that the front page and the index reach directly or indirectly."""
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
