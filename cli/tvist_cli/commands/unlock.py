"""`tvist unlock`: make a stopped robot ready to be moved again."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json


def unlock(
    endpoint: str = "tcp/127.0.0.1:7447",
    *,
    name: str | None = None,
    power_on: bool = False,
    security: Path | None = None,
    namespace: str = "",
    json: bool = False,
) -> None:
    """Take control of a served robot and clear what keeps it from moving.

    The command restarts a safety system that found a violation or failed, unlocks a protective stop, and checks for
    0.3 s of simulation time that the robot stays ready. A client cannot release a safeguard or emergency stop. The exit
    code is 0 if the robot is then ready to be moved; otherwise it is 1, and a message says why and what to do.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Name of the robot [the only robot at the endpoint, or ur5e].
        power_on: If the arm has no power, switch it on and release the brakes.
        namespace: Namespace of the robot, if it is served in one.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.unlock import unlock as run

    with told():
        report = run(endpoint, name, power_on=power_on, security=security, namespace=namespace)
    if json:
        print_json(report)
    else:
        for sentence in report.done:
            out.print(sentence, soft_wrap=True, markup=False)
    if not report.ok:
        next_step = f". Next: {report.next}" if report.next else ""
        raise Failure(f"{report.robot} is not ready: {report.why}{next_step}")
    if not json:
        already = "" if report.done else "; it was ready before, so nothing was done"
        out.print(f"{report.robot} is ready to be moved{already}", soft_wrap=True, markup=False)
