"""`tvist check`: is a robot there, and well?"""

from pathlib import Path

from tvist_cli.failure import Failure
from tvist_cli.output import out, print_json


def check(
    endpoint: str = "tcp/127.0.0.1:7447",
    *,
    name: str | None = None,
    security: Path | None = None,
    json: bool = False,
) -> None:
    """Shake hands with a served robot, read its state, and have a command refused; exit code 0 if all is well.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Its name [ur5e, or where there is none the first of those that are there, all of which are named].
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.check import check as run

    report = run(endpoint, name, security=security)
    if json:
        print_json(report)
    else:
        for finding in report.findings:
            if finding.ok:
                out.print(f"ok  {finding.what:<8} {finding.said}")
    for finding in report.findings:
        if not finding.ok:
            raise Failure(f"{finding.what} failed: {finding.said}")
