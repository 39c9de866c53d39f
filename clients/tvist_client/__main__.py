"""`python -m tvist_client check`: for a machine that has the client alone."""

import argparse
import sys

import msgspec

from tvist_client.check import Report, check
from tvist_client.robot import ENDPOINT, NAME


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 if all is well, 1 if not, 2 for misuse."""
    parser = argparse.ArgumentParser(prog="python -m tvist_client", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    checking = commands.add_parser(
        "check",
        help="shake hands with a robot, see a state, have a command refused; is it ready to be moved?",
    )
    checking.add_argument(
        "endpoint", nargs="?", default=ENDPOINT, help="where its server listens (%(default)s)"
    )
    checking.add_argument("--name", help=f"the robot's name ({NAME}, or the first that is there)")
    checking.add_argument(
        "--security", metavar="DIR", help="folder with this client's certificate, for tls/HOST:PORT"
    )
    checking.add_argument(
        "--alive",
        action="store_true",
        help="ask only whether the server answers and ticks, even if the robot has stopped: for orchestrators",
    )
    checking.add_argument("--json", action="store_true", help="print one JSON object")
    chosen = parser.parse_args(arguments)
    report = check(chosen.endpoint, chosen.name, alive=chosen.alive, security=chosen.security)
    text = msgspec.json.encode(report).decode() if chosen.json else describe(report)
    sys.stdout.write(text + "\n")
    return 0 if report.ok else 1


def describe(report: Report) -> str:
    """A report for a person: a line a step."""
    lines = [f"{'ok  ' if step.ok else 'FAIL'}  {step.what:<8} {step.said}" for step in report.findings]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
