"""`python -m tools.site.commands FOLDER`: write a page for each command from its help.

This runs where the program is installed; the rest of the site does not need it.
"""

import io
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tools.site.tree import ROOT

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions

FOLDER = "commands"  # folder of these pages in the site
OVERVIEW = "cli/README.md"  # page that lists the commands
OPTION = re.compile(r"(?<!\w)--[a-z][\w-]*")
NAMED = re.compile(r"`tvist (?P<command>[a-z ]+)`")


def page_of(command: str) -> str:
    """Return the path in the site of the page of a command, such as `log analyze`."""
    return f"{FOLDER}/{command.replace(' ', '-')}.md"


def written(site: Path) -> dict[str, list[str]]:
    """Write the pages into the site's sources, and return the commands by group."""
    command = [str(ROOT / ".venv" / "bin" / "python"), "-m", "tools.site.commands", str(site)]
    made = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    groups = dict(json.loads(made.stdout))
    names = {name for group in groups.values() for name in group}

    def linked(it: re.Match[str]) -> str:
        return f"[{it[0]}](../{page_of(it['command'])})" if it["command"] in names else it[0]

    overview = site / OVERVIEW
    overview.write_text(NAMED.sub(linked, overview.read_text(encoding="utf-8")), encoding="utf-8")
    return groups


def _write_panel(console: "Console", options: "ConsoleOptions", panel: "HelpPanel") -> None:  # noqa: ARG001
    """Write a panel of a help text as a Markdown table below its title, unless it is empty."""
    from tvist_cli.help_boxes import named_once

    if rows := [_row(named_once(entry)) for entry in panel.entries]:
        console.file.write(f"## {panel.title}\n\n| | |\n|---|---|\n{''.join(rows)}\n")


def _row(entry: "HelpEntry") -> str:
    told = _plain(entry.description)
    if entry.choices and not all(choice in told for choice in entry.choices):
        told += f" One of {', '.join(entry.choices)}."
    told += f" [{entry.default}]" if entry.default is not None else ""
    told += " (required)" if entry.required else ""
    parts = " ".join(told.replace("|", "\\|").split()).split("`")
    parts[::2] = [
        OPTION.sub(r"`\g<0>`", part.replace("*", "\\*").replace("<", "&lt;")) for part in parts[::2]
    ]
    return (
        f"| {'<br>'.join(f'`{name}`' for name in entry.display_labels_with_metavar)} | {'`'.join(parts)} |\n"
    )


def _plain(text: Any) -> str:
    return str(getattr(text, "primary_renderable", text) or "")


def page(command: str) -> str:
    """Return the Markdown page of a command: description, example, options."""
    from rich.console import Console

    from tvist_cli.main import application

    words, said = command.split(), io.StringIO()
    app = application(words)
    app.help_format, app.help_formatter = "plaintext", _write_panel
    app.help_print(words, console=Console(file=said, width=10_000))
    usage, _, text = said.getvalue().strip().partition("\n")
    text, _, example = text.rpartition("Example: ")
    about, box, options = text.partition("## ")
    shown = f"```sh\n{example.strip('` ')}\n```\n\nUsage: `{usage}`"
    return f"# tvist {command}\n\n{about.strip()}\n\n{shown}\n\n{box}{options}"


def main() -> None:
    """Write the pages, and print the commands by group as JSON."""
    from tvist_cli.main import GROUPS, examples

    groups = {
        group: [name for name in examples() if name.partition(" ")[0] in commands]
        for group, commands in GROUPS.items()
    }
    Path(sys.argv[1], FOLDER).mkdir(parents=True, exist_ok=True)
    for name in examples():
        Path(sys.argv[1], page_of(name)).write_text(page(name), encoding="utf-8")
    print(json.dumps(groups))


if __name__ == "__main__":
    main()
