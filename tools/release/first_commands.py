"""The first command of each page, and what the table `first_commands.toml` says that it needs."""

import re
import textwrap
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_suffix(".toml")
FENCE = re.compile(
    r"^(?P<indent> *)```(?P<kind>\w*)\n(?P<text>.*?)^(?P=indent)```$", re.MULTILINE | re.DOTALL
)
OURS = re.compile(r"(?:\.venv/bin/)?((?:tvist|python) .*)")


@dataclass(frozen=True)
class First:
    """The first command of a page, and what it needs; the table describes each."""

    page: str
    command: str = ""
    install: str = "tvist[server]"
    listens: bool = False
    robot: list[str] | None = None
    files: dict[str, str] = field(default_factory=dict)
    before: str = ""
    instead: dict[str, str] = field(default_factory=dict)
    skip: str = ""


def pages(root: Path) -> list[Path]:
    """Return the pages of a checkout: the documents, and what introduces each folder to its users."""
    found = {*root.glob("*.md"), *root.glob("*/README.md"), *root.glob("clients/*/README.md")}
    found |= {page for page in (root / "docs").rglob("*.md") if page.parent.name != "decisions"}
    return sorted(found - {root / name for name in ("CHANGELOG.md", "CONTRIBUTING.md", "tests/README.md")})


def fences(text: str) -> list[tuple[str, str]]:
    """Return kind and text of each fence of a page."""
    return [(match["kind"], textwrap.dedent(match["text"])) for match in FENCE.finditer(text)]


def first_commands(root: Path) -> tuple[list[First], list[str]]:
    """Return the first command of each page that has one, and the pages that show no command at all."""
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    found, silent = [], []
    for page in pages(root):
        name = page.relative_to(root).as_posix()
        if first := first_command(name, fences(page.read_text(encoding="utf-8")), table):
            found.append(first)
        else:
            silent.append(name)
    if lost := table["pages"].keys() - {first.page for first in found}:
        raise ValueError(f"{TABLE.name} has entries of pages without a command: {', '.join(sorted(lost))}")
    return found, silent


def first_command(page: str, shown: list[tuple[str, str]], table: dict[str, Any]) -> First | None:
    """Return the first command of a page with fences, as the table changes it; None if it shows none."""
    lines = [line for kind, text in shown if kind in {"", "sh"} for line in text.splitlines() if line]
    ours = [match[1].partition("  #")[0].strip() for line in lines if (match := OURS.match(line))]
    needs = table["pages"].get(page, {})
    if ours or "command" in needs:
        needs = {"command": next(iter(ours), ""), **needs}
        _, *words = needs["command"].split()
        known = table["commands"].get(" ".join(words[:2]), table["commands"].get(words[0], {}))
        first = First(page, **{**known, **needs})
    elif any(kind == "sh" for kind, _ in shown):
        first = First(
            page, lines[0].partition("  #")[0], skip=f"shows commands of {lines[0].split()[0]} alone"
        )
    else:
        return First(page, **needs) if needs else None
    for old, new in first.instead.items():
        first = replace(first, command=first.command.replace(old, new))
    return first
