"""Entry of the `tvist` program: which commands there are. Each is imported when it is called."""

import sys
from importlib.metadata import version


def main() -> None:
    """Run the program."""
    try:
        import cyclopts
    except ImportError:
        sys.exit("tvist: the command line needs the server's packages: pip install 'tvist[lab]'")
    from tvist_cli.failure import Failure

    app = cyclopts.App(
        name="tvist",
        help="A robot controller for a flexible arm in simulation, with time-varying input shaping.",
        version=version("tvist"),
        help_format="plaintext",
    )
    for name in (
        "serve", "demo", "paper", "identify", "record", "replay", "analyze", "check", "move", "watch", "bench", "keys",
    ):  # fmt: skip
        app.command(f"tvist_cli.commands.{name}:{name}", name=name)
    try:
        app(exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        print(f"tvist: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)
    except Failure as failure:
        print(f"tvist: {failure}", file=sys.stderr)
        sys.exit(failure.code)
    except KeyboardInterrupt:
        sys.exit(130)
