"""`tvist forget`: discard what a served robot has learnt about its payload."""

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.output import print_lines
from tvist_client.robot import Robot
from tvist_protocol.io import Io


def forget(*, at: Connection = LOCAL, json: bool = False) -> None:
    """Take control of a served robot and discard what it has learnt about its payload.

    A robot served with --adapt payload then moves as if it carried the declared payload, until its motions show
    otherwise again. If another client has control, the command fails with exit code 1 and changes nothing.

    Args:
        at: Where the robot is.
        json: Print one JSON object.
    """

    async def run(robot: Robot) -> tuple[str, Io]:
        before = await robot.io()
        async with robot.control("tvist forget") as arm:
            await arm.forget()
        return (await robot.info()).name, before

    robot, before = at.run(run)
    declared, assumed = before.payload.mass, before.assumed_payload
    said = (
        f"{robot} has learnt nothing of its payload: it assumes the declared {declared:g} kg"
        if assumed is None
        else f"{robot} assumes the declared {declared:g} kg again, not {assumed.mass:g} kg"
    )
    result = {"robot": robot, "declared_kg": declared, "forgot_kg": assumed and assumed.mass}
    print_lines(result, [said], json=json)
