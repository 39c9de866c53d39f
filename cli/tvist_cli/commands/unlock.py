"""`tvist unlock`: make a stopped robot ready to move again."""

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure
from tvist_cli.output import print_lines
from tvist_client import unlock as client
from tvist_client.robot import Robot
from tvist_client.unlock import UnlockReport


def unlock(at: Connection = LOCAL, *, power_on: bool = False, json: bool = False) -> None:
    """Take control of a served robot and clear what keeps it from moving.

    The command restarts a safety system that found a violation or failed, unlocks a protective stop, and checks for
    0.3 s of simulation time that the robot stays ready. A client cannot release a safeguard stop or an emergency stop.
    Exit code 0: the robot is ready to move. Exit code 1: it is not; the message gives the reason and the next step.

    Args:
        at: Where the robot is.
        power_on: Switch the arm on and release the brakes if it has no power.
        json: Print one JSON object.
    """

    async def run(robot: Robot) -> UnlockReport:
        command = at.unlock_command((await robot.info()).name)
        return await client.unlock(robot, at.endpoint, command, power_on=power_on)

    report = at.run(run)
    already = "" if report.done else "; it was ready before, so nothing was done"
    ready = [f"{report.robot} is ready to be moved{already}"] if report.ok else []
    print_lines(report, [*report.done, *ready], json=json)
    if not report.ok:
        next_step = f". Next: {report.next}" if report.next else ""
        raise Failure(f"{report.robot} is not ready: {report.why}{next_step}")
