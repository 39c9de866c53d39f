"""`python -m tvist_client check`, for machines that have only the client."""

import argparse
import math
import sys

import msgspec

from tvist_client.check import check
from tvist_client.robot import ENDPOINT, NAME
from tvist_protocol.errors import harmless


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return 0 for success, 1 for a failed check, 2 for wrong arguments."""
    parser = argparse.ArgumentParser(prog="python -m tvist_client", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    checking = commands.add_parser(
        "check",
        help="check that a robot answers, sends its state, refuses a command without control and is ready to be moved",
    )
    checking.add_argument(
        "endpoint", nargs="?", default=ENDPOINT, help="Zenoh endpoint of the robot's server (%(default)s)"
    )
    checking.add_argument(
        "--name", help=f"name of the robot ({NAME}, or else the first robot at the endpoint)"
    )
    checking.add_argument("--namespace", default="", help="namespace of the robot")
    checking.add_argument(
        "--security", metavar="DIR", help="folder with this client's certificate, for tls/HOST:PORT"
    )
    checking.add_argument(
        "--alive",
        action="store_true",
        help="check only that the server answers and ticks, even if the robot has stopped (for orchestrators)",
    )
    checking.add_argument(
        "--wait",
        metavar="SECONDS",
        nargs="?",
        type=float,
        default=0.0,
        const=math.inf,
        help="try again for this long while no robot answers or it is starting; without SECONDS, until it is ready",
    )
    checking.add_argument("--json", action="store_true", help="print one JSON object")
    chosen = parser.parse_args(arguments)
    report = check(
        chosen.endpoint,
        chosen.name,
        alive=chosen.alive,
        security=chosen.security,
        namespace=chosen.namespace,
        wait=chosen.wait,
        tell=lambda said: sys.stderr.write(f"{said}\n"),
    )
    lines = (f"{'ok  ' if step.ok else 'FAIL'}  {step.what:<8} {step.said}" for step in report.findings)
    text = msgspec.json.encode(report).decode() if chosen.json else "\n".join(lines)
    sys.stdout.write(harmless(text) + "\n")
    return 0 if report.ok else 1


if __name__ == "__main__":
    sys.exit(main())
