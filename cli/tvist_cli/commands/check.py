"""`tvist check`: check that a robot answers and is ready to move."""

import math
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure
from tvist_cli.output import print_lines, waiting
from tvist_client import check as client


def check(
    at: Connection = LOCAL,
    *,
    alive: bool = False,
    wait: Annotated[list[float] | None, Parameter(consume_multiple=(0, 1), allow_repeating=False)] = None,
    json: bool = False,
) -> None:
    """Check that a served robot answers and is ready to move, without changing anything.

    If no name is given and there are several robots but no ur5e, the command checks the first and lists them all. Exit
    code 0: the robot answers, ticks on time, refuses commands from clients without control, has power, and its safety
    system allows motion. Exit code 1: one of these does not hold; the message gives the reason and the next step.

    Args:
        at: Where the robot is.
        alive: Check only that the server answers and, in real time, ticks. A stopped robot passes as well, so
            that an orchestrator does not kill a robot that somebody is about to unlock.
        wait: Try again for this many seconds while no robot answers or the robot is starting; without a
            number, until it is ready.
        json: Print one JSON object.
    """
    seconds = 0.0 if wait is None else wait[0] if wait else math.inf
    with waiting(f"asking {at.name or 'the robot'} at {at.endpoint}, which takes seconds") as tell:
        report = client.check(
            at.endpoint,
            at.name,
            alive=alive,
            security=at.security,
            namespace=at.namespace,
            wait=seconds,
            tell=tell,
        )
    lines = (f"ok  {one.what:<8} {one.said}" for one in report.findings if one.ok)
    print_lines(report, lines, json=json)
    if not report.ok:
        last = report.findings[-1]
        what = "the robot is not ready" if last.what in {"ready", "load"} else f"{last.what} failed"
        raise Failure(last.said if report.starting else f"{what}: {last.said}")
