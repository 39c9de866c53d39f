"""Entry point of `tvist` and its list of commands; each command is imported only when it is called."""

import gc
import os
import shutil
import signal
import sys
import textwrap
import time
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_server.shutdown import end_like_interrupted, ending_signals

if TYPE_CHECKING:
    import cyclopts

BEGAN = time.monotonic()  # start of this program, before the slow imports
ABOUT = "A robot controller for a flexible arm in simulation, with time-varying input shaping."
LOG = {
    "record": "Record a served robot as MCAP.",
    "analyze": "Show what a recording or log contains and measure its motions, or compare two.",
    "advise": "Find in logs what rings, and recommend a shaper.",
    "report": "Write a web page about recordings: a verdict, tables and figures in one file.",
    "export": "Write a recording as CSV or Parquet, or for Foxglove.",
    "replay": "Run a recording's commands again and compare bit by bit, or publish it.",
}
GROUPS = {
    "Robots": {
        "serve": "Run a robot on the network.",
        "run": "Run a URScript program on a new robot; exit code 0 if it ends by itself.",
        "check": "Check that a robot answers and is ready to move; exit code 0 if so.",
        "move": "Move a served robot to a pose.",
        "watch": "Show live what one or all served robots are doing.",
        "view": "Show a robot on a web page, with magnified vibration.",
        "stop": "Stop a served robot, or all, even if another client has control; exit code 0 if at rest.",
        "unlock": "Make a stopped robot ready to move again; exit code 0 if it is.",
        "ros2": "Connect a served robot with ROS 2.",
        "forget": "Discard what a served robot has learnt about its payload.",
    },
    "Logs": {"log": f"Use recordings and other robots' logs: {', '.join(LOG)}."},
    "Studies": {
        "study": "Compare shapers in simulation: on any moves, two of them, all of them, or in your own study."
    },
    "Make and manage": {
        "demo": "Run the paper's experiment, in real time or simulated, and compare the results with the paper.",
        "lesson": "Open a page for trying out shaping.",
        "identify": "Calibrate a robot from jogs or logs, weigh its payload, or fit a twin.",
        "robots": "List the arms with measured and assumed values, or measure how well auto suppresses vibration.",
        "shapers": "List the shapers with their duration and robustness to a wrong frequency.",
        "keys": "Create TLS certificates for a robot and its clients.",
        "router": "Run a router that connects the robots and clients of a fleet.",
        "bench": "Measure how fast tvist runs on this machine.",
        "completion": "Print the script with which a shell completes commands, options and values.",
    },
}
"""The commands with their one-line help, in groups, in the order in which a new user meets them."""
OF_GROUPS = {"log": LOG}  # commands that have subcommands
COMMANDS = {name: what for group in GROUPS.values() for name, what in group.items()}


def program() -> None:
    """Run `tvist` as a program: see `main`."""
    # Child processes must not import modules from the working folder, which may be somebody else's.
    os.environ["PYTHONSAFEPATH"] = "1"
    main()


def main() -> None:
    """Run the command line; Control+C or another signal ends it with exit code 130 and without a traceback."""
    try:
        _run()
    except KeyboardInterrupt:
        print("tvist: interrupted", file=sys.stderr)
        sys.exit(130)


def _default(value: object) -> str | None:
    """Return the default as a help text shows it: None for a switch that is off, or an empty value."""
    if value in (None, False, "", ()):
        return None
    return "on" if value is True else f"{value:g}" if isinstance(value, float) else str(value)


def application(called: Sequence[str] = ()) -> "cyclopts.App":
    """Return the parser for all commands and options.

    The help of the command `called` (its words) is its docstring; other commands only have one-line help.
    """
    from importlib.metadata import version

    import cyclopts

    from tvist_cli.help_boxes import HelpBoxes
    from tvist_cli.misuse import check_whole, finite

    app = cyclopts.App(
        name="tvist",
        help=ABOUT,
        version=version("tvist"),
        help_format="markdown",  # joins the lines of a docstring
        help_formatter=HelpBoxes(),
        default_parameter=cyclopts.Parameter(negative=(), validator=finite, show_default=_default),
        config=check_whole,
        suppress_keyboard_interrupt=False,  # `main` reports the interruption
    )
    _add(app, "tvist_cli.commands", COMMANDS, called[:1])
    for name, commands in OF_GROUPS.items():
        group = cyclopts.App(name=name, help=COMMANDS[name], sort_key=list(COMMANDS).index(name))
        app.command(group)
        _add(group, f"tvist_cli.commands.{name}", commands, called[1:2] if called[:1] == [name] else ())
    return app


def _overview() -> str:
    """Return the help of the program without the parser, which takes longer to import."""
    indent, columns = " " * (max(map(len, COMMANDS)) + 4), min(shutil.get_terminal_size().columns, 120)
    lines = ["Usage: tvist COMMAND", "", *textwrap.wrap(ABOUT, columns), ""]
    options = {
        "--help": "Print this list; after a command, print what it does and its options.",
        "--version": "Print the version.",
    }
    for group, commands in {**GROUPS, "Options": options}.items():
        lines.append(f"{group}:")
        for name, what in commands.items():
            first = f"  {name}".ljust(len(indent))
            lines += textwrap.wrap(what, columns, initial_indent=first, subsequent_indent=indent)
        lines.append("")
    return "\n".join(lines[:-1])


@cache
def examples() -> dict[str, str]:
    """Return an example command line for each command that can run by itself, keyed by words such as `log analyze`."""
    return tomllib.loads(Path(__file__).with_name("examples.toml").read_text(encoding="utf-8"))


def _add(app: "cyclopts.App", package: str, commands: Mapping[str, str], called: Sequence[str]) -> None:
    for place, (name, what) in enumerate(commands.items()):
        if name not in OF_GROUPS:
            example = examples()[" ".join([*package.split(".")[2:], name])]
            app.command(
                f"{package}.{name}:{name}",
                name=name,
                help=None if name in called else what,
                help_epilogue=f"Example: `{example}`",
                sort_key=place,
            )


def _run() -> None:
    if sys.argv[1:2] == ["serve"] and "--compile" not in sys.argv:
        gc.disable()  # imported objects live until the end; `serve` switches the collector on again
        # Nothing is served yet, so a signal can end the process at once. As the first process of a container,
        # it has no default action for signals.
        for number in ending_signals():
            if number != signal.SIGINT:
                signal.signal(number, lambda *_: os._exit(0))
    else:
        end_like_interrupted()
    if sys.argv[1:] in (["--help"], ["-h"]):
        try:
            print(_overview(), flush=True)
        except BrokenPipeError:  # the reader of the output has closed it
            os._exit(1)
        return
    # The matrices are small: threads for them would slow down each other and the control loop.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        import cyclopts
    except ImportError:
        sys.exit(
            "tvist: more than the client is needed: pip install 'tvist[server]', for studies 'tvist[lab]'"
        )
    from tvist_cli.failure import Failure, failing_on
    from tvist_cli.misuse import message_of, readable
    from tvist_protocol.errors import harmless

    # Print only the message of a warning, without a line of code.
    warnings.formatwarning = lambda message, *_, **__: harmless(f"tvist: {message}\n")
    app = application(sys.argv[1:3])
    try:
        with failing_on(OSError):  # errors that the command itself does not handle
            app(readable(sys.argv[1:]), exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        group = (error.command_chain or ("",))[0]
        said = message_of(error, tuple(OF_GROUPS.get(group, COMMANDS)))
        print(harmless(f"tvist: {said}"), file=sys.stderr)
        sys.exit(2)
    except Failure as failure:
        print(harmless(f"tvist: {failure}"), file=sys.stderr)
        sys.exit(failure.code)
