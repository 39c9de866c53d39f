"""Pages for what is linked and is no page: source files, and folders."""

import os
from pathlib import Path

from tools.site.tree import ROOT

LANGUAGES = {".py": "python", ".toml": "toml", ".json": "json", ".yaml": "yaml", ".yml": "yaml"}
"""How to highlight files, by their ending; others are shown as text."""
SHOWN_AS_IS = {".png", ".gif", ".svg"}
"""Endings of files that a browser shows by itself: they are copied."""


def page_of(path: Path) -> Path:
    """Return where the site shows a file or folder that is no page, relative to the repository."""
    inside = path.relative_to(ROOT)
    if path.suffix in SHOWN_AS_IS:
        return inside
    return inside / "folder.md" if path.is_dir() else inside.with_name(f"{inside.name}.md")


def shown(path: Path) -> str:
    """Return the page of a source file or folder, in Markdown."""
    name = path.relative_to(ROOT)
    # These pages repeat what others explain, so the search leaves them out.
    head = f"---\nsearch:\n  exclude: true\n---\n\n# `{name}`\n\n"
    if path.is_dir():
        inside = sorted(entry for entry in path.iterdir() if not entry.name.startswith(("_", ".")))
        return head + "".join(f"- `{entry.name}{'/' if entry.is_dir() else ''}`\n" for entry in inside)
    text = path.read_text(encoding="utf-8")
    fence = "`" * 6
    return f"{head}{fence}{LANGUAGES.get(path.suffix, 'text')}\n{text.rstrip()}\n{fence}\n"


def way(page: Path, to: Path) -> str:
    """Return the link from a page to another, both relative to the repository."""
    return Path(os.path.relpath(to, page.parent)).as_posix()
