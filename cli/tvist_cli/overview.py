"""The list of all commands, as `tvist --help` prints it; made without the parser, which takes longer to import."""

from collections.abc import Mapping

ABOUT = "A robot controller for a flexible arm in simulation, with time-varying input shaping."


def overview(commands: Mapping[str, str]) -> str:
    """Return the help of the program.

    Args:
        commands: Commands with their one-line help.
    """
    width = max(map(len, commands)) + 2
    lines = [f"  {name:<{width}}{what}" for name, what in commands.items()]
    return "\n".join(
        [
            "Usage: tvist COMMAND",
            "",
            ABOUT,
            "",
            "Commands:",
            *lines,
            "",
            "Options:",
            f"  {'--help':<{width}}Print this list; after a command, print what it does and its options.",
            f"  {'--version':<{width}}Print the version.",
        ]
    )
