"""`tvist unlock`: make a robot that has stopped ready again."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json


def unlock(
    endpoint: str = "tcp/127.0.0.1:7447",
    *,
    name: str | None = None,
    power_on: bool = False,
    security: Path | None = None,
    json: bool = False,
) -> None:
    """Take control of a served robot and release what keeps it from moving.

    It restarts a safety system that found a violation or failed, unlocks a protective stop, and watches for 0.3 s of
    the robot's time whether it holds. Safeguard and emergency stops are not a client's to release. Exit code 0 if the
    robot is ready to be moved afterwards; otherwise 1, and a sentence says what remains and what to do about it.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Its name [the only robot there, or ur5e].
        power_on: Switch the power on and release the brakes, too, where the arm is without power.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.unlock import unlock as run

    with told():
        report = run(endpoint, name, power_on=power_on, security=security)
    if json:
        print_json(report)
    else:
        for sentence in report.done:
            out.print(sentence, soft_wrap=True, markup=False)
    if not report.ok:
        next_step = f". Next: {report.next}" if report.next else ""
        raise Failure(f"{report.robot} is not ready: {report.why}{next_step}")
    if not json:
        already = "" if report.done else ", and was before: nothing was done"
        out.print(f"{report.robot} is ready to be moved{already}", soft_wrap=True, markup=False)
