"""The list of all commands, as `tvist --help` prints it; made without the parser, which takes longer to import."""

from collections.abc import Mapping

ABOUT = "A robot controller for a flexible arm in simulation, with time-varying input shaping."


def overview(groups: Mapping[str, Mapping[str, str]]) -> str:
    """Return the help of the program.

    Args:
        groups: Commands with their one-line help, by the name of their group.
    """
    width = max(len(name) for commands in groups.values() for name in commands) + 2
    lines = ["Usage: tvist COMMAND", "", ABOUT, ""]
    for group, commands in groups.items():
        lines += [f"{group}:", *(f"  {name:<{width}}{what}" for name, what in commands.items()), ""]
    return "\n".join(
        [
            *lines,
            "Options:",
            f"  {'--help':<{width}}Print this list; after a command, print what it does and its options.",
            f"  {'--version':<{width}}Print the version.",
        ]
    )
