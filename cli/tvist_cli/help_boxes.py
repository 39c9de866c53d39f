"""The boxes of options that --help prints."""

from cyclopts.help import DefaultFormatter, HelpEntry, HelpPanel
from rich.console import Console, ConsoleOptions


class HelpBoxes(DefaultFormatter):
    """Hides the option form of a positional argument: `--target` works for TARGET, but the help need not show it."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Print one box of a help text."""
        super().__call__(console, options, panel.copy(entries=list(map(named_once, panel.entries))))


def named_once(entry: HelpEntry) -> HelpEntry:
    """Return an entry of a help text, without the option form if the argument is positional."""
    return entry.copy(positive_names=()) if entry.positional_label else entry
