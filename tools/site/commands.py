"""`python -m tools.site.commands FOLDER`: writes a page of each command, made from its own help.

Runs where the program is installed; the rest of the site is made without it.
"""

import io
import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from tvist_cli.examples import EXAMPLES
from tvist_cli.help_boxes import named_once
from tvist_cli.main import GROUPS, OF_GROUPS, application

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import ConsoleOptions

OPTION = re.compile(r"(?<!\w)--[a-z][\w-]*")


def grouped() -> dict[str, list[str]]:
    """Return the commands by group, those of a command behind it."""
    return {
        group: [name for command in commands for name in [command, *_within(command)] if name in EXAMPLES]
        for group, commands in GROUPS.items()
    }


def _within(command: str) -> list[str]:
    return [f"{command} {name}" for name in OF_GROUPS.get(command, {})]


class Markdown:
    """What the parser gives a help text to: keeps it as Markdown."""

    show_metavar = True

    def __init__(self) -> None:
        self.usage = self.about = ""
        self.boxes: list[str] = []

    def render_usage(self, _console: Console, _options: "ConsoleOptions", usage: Any) -> None:
        """Keep the line that shows how to call the command."""
        self.usage = str(usage).strip()

    def render_description(self, _console: Console, _options: "ConsoleOptions", description: Any) -> None:
        """Keep what the command does."""
        self.about = _plain(description)

    def __call__(self, _console: Console, _options: "ConsoleOptions", panel: "HelpPanel") -> None:
        """Keep the rows of a box, under its title."""
        if rows := list(map(_row, map(named_once, panel.entries))):
            self.boxes.append(f"## {panel.title}\n\n| | |\n|---|---|\n" + "".join(rows))


def _row(entry: "HelpEntry") -> str:
    told = _plain(entry.description)
    if entry.choices and not all(choice in told for choice in entry.choices):
        told += f" One of {', '.join(entry.choices)}."
    if entry.default is not None:
        told += f" [{entry.default}]"
    if entry.required:
        told += " (required)"
    names = "<br>".join(f"`{name}`" for name in entry.display_labels_with_metavar)
    return f"| {names} | {_cell(told)} |\n"


def _plain(text: Any) -> str:
    return str(getattr(text, "primary_renderable", text) or "").strip()


def _cell(text: str) -> str:
    parts = " ".join(text.replace("|", "\\|").split()).split("`")
    parts[::2] = [
        OPTION.sub(r"`\g<0>`", part.replace("*", "\\*").replace("<", "&lt;")) for part in parts[::2]
    ]
    return "`".join(parts)


def page(command: str) -> str:
    """Return the page of a command, such as `log analyze`, in Markdown."""
    words, kept = command.split(), Markdown()
    app = application(words)
    app.help_format, app.help_formatter = "plaintext", kept
    app.help_print(words, console=Console(file=io.StringIO()))
    head = f"# tvist {command}\n\n{kept.about}\n\n```sh\n{EXAMPLES[command]}\n```\n\n"
    return f"{head}Usage: `{kept.usage}`\n\n" + "\n".join(kept.boxes)


def main() -> None:
    """Write the pages into a folder, and their groups beside them as one line of JSON on the standard output."""
    folder, groups = Path(sys.argv[1]), grouped()
    folder.mkdir(parents=True, exist_ok=True)
    for names in groups.values():
        for name in names:
            (folder / f"{name.replace(' ', '-')}.md").write_text(page(name), encoding="utf-8")
    print(json.dumps(groups))


if __name__ == "__main__":
    main()
