"""The pages of the commands: where they are, and links to them where a page first names a command."""

import json
import re
import subprocess
from pathlib import Path

from tools.site.sources import way
from tools.site.tree import CODE, ROOT

PYTHON = ROOT / ".venv" / "bin" / "python"
"""What has the program installed: the site itself is made without it."""
FOLDER = "commands"
"""Folder of these pages in the site."""
LINK = re.compile(r"\[[^\[\]]*\]\([^)]*\)|^#[^\n]*$|<picture>.*?</picture>", re.MULTILINE | re.DOTALL)
SPAN = re.compile(r"`tvist (?P<words>[a-z]+(?: [a-z]+)?)[^`\n]*`")


def page_of(command: str) -> Path:
    """Return where the page of a command is in the site."""
    return Path(FOLDER, f"{command.replace(' ', '-')}.md")


def write(pages: Path) -> dict[str, list[str]]:
    """Write the pages of the commands, and return the commands by group."""
    command = [PYTHON, "-m", "tools.site.commands", pages / FOLDER]
    made = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return dict(json.loads(made.stdout))


def with_links(text: str, page: Path, commands: set[str]) -> str:
    """Return a page's text in which the first mention of each command leads to the command's page.

    Args:
        text: Text of the page, in Markdown.
        page: Its path in the site.
        commands: Words of all commands.
    """
    # Headings, links and blocks stay as they are.
    kept = [
        match.span() for match in (*LINK.finditer(text), *CODE.finditer(text)) if match[0][:6] != "`tvist"
    ]
    places = []
    for match in SPAN.finditer(text):
        words = match["words"] if match["words"] in commands else match["words"].partition(" ")[0]
        if words in commands and not any(start <= match.start() < end for start, end in kept):
            commands = commands - {words}
            places.append((match, words))
    for match, words in reversed(places):
        link = f"[{match[0]}]({way(page, page_of(words))})"
        text = text[: match.start()] + link + text[match.end() :]
    return text
