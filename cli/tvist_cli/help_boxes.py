"""The boxes with options that --help prints."""

from cyclopts.help import DefaultFormatter, HelpEntry, HelpPanel
from rich.console import Console, ConsoleOptions


class HelpBoxes(DefaultFormatter):
    """Shows what is given by its place under one name; its option, `--target` of TARGET, works but needs no showing."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Print a box of a help text."""
        super().__call__(console, options, panel.copy(entries=list(map(named_once, panel.entries))))


def named_once(entry: HelpEntry) -> HelpEntry:
    """Return a line of a help text, without the option of what is given by its place."""
    return entry.copy(positive_names=()) if entry.positional_label else entry
