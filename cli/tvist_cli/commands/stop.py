"""`tvist stop`: stop one robot or all, even if another client has control."""

import asyncio
from dataclasses import replace
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, Misuse, failing_on, interruptible
from tvist_cli.output import print_lines
from tvist_client.fleet import Fleet, RobotPlace, StopReport, place_of
from tvist_client.halt import halt


def stop(
    robot: str | None = None,
    *,
    everyone: Annotated[bool, Parameter(name="--all")] = False,
    at: Connection = LOCAL,
    json: bool = False,
) -> None:
    """Stop a served robot at once, even if another client has control, and print what was stopped.

    The command ends motions, streams of set-points, and programs that may move the arm. Exit code 0: the arm
    is at rest, or in lockstep will be after the next steps. Exit code 1: the robot does not answer, refuses,
    or a client has moved it again; the message gives the reason.

    The client that has control keeps it and can move the robot again. With --all, the answer of each robot is
    printed; the exit code is 0 if all have stopped and 1 if one did not answer or refused.

    Args:
        robot: Stop the robot of this name, as with --name, or NAMESPACE/NAME.
        everyone: Stop all robots that the router or server reaches; with --namespace, those in it or below it.
        at: Where the robot is.
        json: Print one JSON object.
    """
    called = robot or at.name
    if everyone:
        if called is not None:
            raise Misuse(f"give either --all or the robot {called}")
        _stop_all(at, json=json)
        return
    with failing_on(exit_code=2):
        place = RobotPlace("", "") if called is None else place_of(called)
    one = replace(at, name=place.robot or None, namespace=place.namespace or at.namespace)
    report = one.run(lambda robot: halt(robot, at.endpoint))
    said = f"stopped {' and '.join(report.stopped)}" if report.stopped else "nothing was under way"
    if report.stopped is None:
        said = "the stop begins with the next step of its clock"
    print_lines(report, [f"{report.robot}: {said}"], json=json)
    if not report.ok:
        raise Failure(f"{report.robot} may still be moving: {report.why}")


def _stop_all(at: Connection, *, json: bool) -> None:
    async def run() -> list[StopReport]:
        async with Fleet(at.endpoint, security=at.security, namespace=at.namespace) as fleet:
            return await fleet.stop(list(fleet.places))

    with interruptible("robots that had not answered may still be moving"):
        reports = asyncio.run(run())
    if not reports:
        raise Failure("there are no robots, so none was stopped: check endpoint and namespace")
    said = (f"{RobotPlace(report.namespace, report.name)}: {report.said}" for report in reports)
    print_lines({"robots": reports}, said, json=json)
    if failed := [report.name for report in reports if not report.ok]:
        count = f"{len(failed)} of {len(reports)} robots"
        raise Failure(f"{count} may still be moving; the first is {failed[0]}")
