"""`tvist forget`: undo what a served robot has learnt of its payload."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import told
from tvist_cli.output import out, print_json

if TYPE_CHECKING:
    from tvist_protocol.io import Io


def forget(
    *,
    endpoint: str = "tcp/127.0.0.1:7447",
    name: str | None = None,
    security: Path | None = None,
    namespace: str = "",
    json: bool = False,
) -> None:
    """Take control of a served robot, and undo what it has learnt of its payload.

    A robot served with --adapt payload then moves as an arm that carries the declared payload, until its motions tell
    it otherwise again. If another client has control, the command fails with exit code 1 and changes nothing.

    Args:
        endpoint: Zenoh endpoint of the robot.
        name: Name of the robot [ur5e; if there is none, the only robot at the endpoint].
        namespace: Namespace of the robot, if it is served in one.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        json: Print one JSON object.
    """
    from tvist_client.robot import NAME, Robot
    from tvist_client.transports.zenoh import only_robot

    async def run() -> tuple[str, "Io"]:
        found = name if name is not None else await only_robot(endpoint, NAME, security, namespace)
        async with await Robot.connect(endpoint, found, security=security, namespace=namespace) as robot:
            before = await robot.io()
            async with robot.control("tvist forget") as arm:
                await arm.forget()
            return found, before

    with told():
        robot, before = asyncio.run(run())
    declared, assumed = before.payload.mass, before.assumed_payload
    if json:
        print_json({"robot": robot, "declared_kg": declared, "forgot_kg": assumed and assumed.mass})
    elif assumed is None:
        out.print(f"{robot} has learnt nothing of its payload: it assumes the declared {declared:g} kg")
    else:
        out.print(f"{robot} assumes the declared {declared:g} kg again, not {assumed.mass:g} kg")
