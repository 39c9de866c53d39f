"""Targets of links that are not pages of the site: pictures, and files of the repository."""

import os
import re
from pathlib import Path

from tools.site.tree import ROOT

PICTURES = {".png", ".gif", ".svg", ".webp"}
"""Suffixes of files that a browser shows by itself; they are copied."""
REPOSITORY = os.environ.get("TVIST_REPOSITORY", "")
"""Address of the repository for links to its files; without it they become plain text."""


def to_repository(text: str, start: int, end: int, path: Path) -> str:
    """Return a page's text with a link to a file or folder redirected to the repository."""
    if REPOSITORY:
        kind = "tree" if path.is_dir() else "blob"
        address = f"{REPOSITORY}/{kind}/main/{path.relative_to(ROOT).as_posix()}"
        return text[:start] + address + text[end:]
    opens = re.compile(r"\[[^\[\]]*\]\($").search(text[:start])
    assert opens is not None, text[:end][-80:]
    return text[: opens.start()] + opens[0][1:-2] + text[end + 1 :]


def way(page: Path, to: Path) -> str:
    """Return the relative link from a page to another."""
    return Path(os.path.relpath(to, page.parent)).as_posix()
