"""`tvist check`: is a robot there, and well?"""

import sys

from tvist_cli.output import print_json


def check(endpoint: str = "tcp/127.0.0.1:7447", *, name: str = "ur5e", json: bool = False) -> None:
    """Shake hands with a served robot, read its state, and have a command refused; exit code 0 if all is well.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Its name.
        json: Print one JSON object.
    """
    from tvist_client.check import check as run

    report = run(endpoint, name)
    if json:
        print_json(report)
    else:
        print(report.sentence())
    if not report.ok:
        sys.exit(1)
