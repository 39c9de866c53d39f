"""`tvist stop`: stop one robot, whoever has control."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json


def stop(
    robot: str | None = None,
    *,
    endpoint: str = "tcp/127.0.0.1:7447",
    security: Path | None = None,
    namespace: str = "",
    json: bool = False,
) -> None:
    """Stop a served robot at once, whoever has control, and say what was stopped.

    It ends motions, streams of set-points, and programs that may move the arm. Exit code 0: the arm is at rest; in
    lockstep it will be after the next steps. Exit code 1: the robot does not answer, refuses, or a
    client has moved it again; the message says why.

    Whoever has control keeps it and can move the robot again. tvist fleet stop --all stops all robots.

    Args:
        robot: Name of the robot, or NAMESPACE/NAME [the only robot at the endpoint, or ur5e].
        endpoint: Zenoh endpoint of the robot.
        namespace: Namespace of the robot, if it is served in one.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.fleet import place_of
    from tvist_client.halt import halt

    with told(code=2):
        place = None if robot is None else place_of(robot)
    with told():
        report = halt(
            endpoint,
            None if place is None else place.robot,
            security=security,
            namespace=namespace if place is None else place.namespace or namespace,
        )
    if json:
        print_json(report)
    else:
        out.print(f"{report.robot}: {_said(report.stopped)}", soft_wrap=True, markup=False)
    if not report.ok:
        raise Failure(f"{report.robot} may still be moving: {report.why}")


def _said(stopped: list[str] | None) -> str:
    if stopped is None:
        return "the stop begins with the next step of its clock"
    return f"stopped {' and '.join(stopped)}" if stopped else "nothing was under way"
