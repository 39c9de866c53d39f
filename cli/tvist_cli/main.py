"""Entry of the `tvist` program: which commands there are. Each is imported when it is called."""

import os
import signal
import sys

from tvist_server.ending import ending_signals

COMMANDS = {
    "serve": "Run a robot on the network.",
    "demo": "See it work: the paper's motions in real time, with figures.",
    "check": "Is a robot there, and ready to be moved? Exit code 0 if so.",
    "unlock": "Make a robot that has stopped ready again; exit code 0 if it is then.",
    "move": "Move a served robot to a pose.",
    "watch": "See live what a served robot does.",
    "record": "Record a served robot as MCAP.",
    "analyze": "Measure the motions of a recording.",
    "replay": "Run a recording's commands again and compare bit by bit.",
    "paper": "Run the paper's experiment and print its tables beside ours.",
    "shapers": "List the shapers: how long they are and what they forgive.",
    "identify": "Calibrate a robot from its own accelerometer.",
    "evaluate": "Shape any moves and say what it does to their vibration.",
    "shaperbench": "Judge shapers, yours too, on eight arms.",
    "search": "Look for ways to make a robot break what it promises.",
    "bench": "Measure how fast it is on this machine.",
    "keys": "Make certificates for a robot that others may reach.",
}
"""What there is, in the order of a first acquaintance."""


def main() -> None:
    """Run the program; Control+C ends it with exit code 130 and without a traceback, whenever it comes."""
    try:
        _run()
    except KeyboardInterrupt:
        print("tvist: interrupted", file=sys.stderr)
        sys.exit(130)


def _run() -> None:
    if sys.argv[1:2] == ["serve"]:
        # Nothing is served yet, so whoever ends it gets what was asked for. As the first process of a container
        # it has no default to end by.
        for number in ending_signals():
            if number != signal.SIGINT:
                signal.signal(number, lambda *_: os._exit(0))
    # Matrices here are small: threads for them only get in each other's, and in the ticks', way.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from importlib.metadata import version

    try:
        import cyclopts
    except ImportError:
        sys.exit("tvist: the command line needs the server's packages: pip install 'tvist[lab]'")
    from tvist_cli.failure import Failure, told
    from tvist_cli.misuse import check_whole, finite, readable, sentence

    app = cyclopts.App(
        name="tvist",
        help="A robot controller for a flexible arm in simulation, with time-varying input shaping.",
        version=version("tvist"),
        help_format="plaintext",
        default_parameter=cyclopts.Parameter(negative=(), validator=finite),
        config=check_whole,
    )
    for place, (name, what) in enumerate(COMMANDS.items()):
        app.command(f"tvist_cli.commands.{name}:{name}", name=name, help=what, sort_key=place)
    try:
        with told(OSError):  # a folder for figures that is none, mostly
            app(readable(sys.argv[1:]), exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        print(f"tvist: {sentence(error, tuple(COMMANDS))}", file=sys.stderr)
        sys.exit(2)
    except Failure as failure:
        print(f"tvist: {failure}", file=sys.stderr)
        sys.exit(failure.code)
