"""`tvist check`: is a robot there, and ready to be moved?"""

from pathlib import Path

from tvist_cli.failure import Failure
from tvist_cli.output import out, print_json


def check(
    endpoint: str = "tcp/127.0.0.1:7447",
    *,
    name: str | None = None,
    alive: bool = False,
    security: Path | None = None,
    json: bool = False,
) -> None:
    """Shake hands with a served robot, and say whether it is ready to be moved.

    Exit code 0: it answers, ticks, guards control, has its power, and its safety system allows motion. Exit code 1:
    one of these is missing; the sentence says why, and what to do next. It changes nothing.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Its name [ur5e, or where there is none the first of those that are there, all of which are named].
        alive: Ask only whether the server answers and, in real time, ticks. That holds for a robot that has stopped,
            too, so an orchestrator does not kill one that somebody is about to unlock.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.check import check as run

    report = run(endpoint, name, alive=alive, security=security)
    if json:
        print_json(report)
    else:
        for finding in report.findings:
            if finding.ok:
                out.print(f"ok  {finding.what:<8} {finding.said}", soft_wrap=True, markup=False)
    for finding in report.findings:
        if not finding.ok:
            what = "the robot is not ready" if finding.what == "ready" else f"{finding.what} failed"
            raise Failure(f"{what}: {finding.said}")
