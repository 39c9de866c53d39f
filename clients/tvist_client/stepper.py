"""Time of a simulated robot that does not tick by itself, and the right to advance it."""

import contextlib
from collections.abc import AsyncIterator, Sequence
from typing import TYPE_CHECKING

from tvist_client.errors import UnexpectedReplyError
from tvist_client.granted import granted
from tvist_client.transports.base import Transport
from tvist_client.values import whole
from tvist_protocol.commands import ReleaseClock, TakeClock
from tvist_protocol.keys import check_client_name
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationStep, StepSetpoint

if TYPE_CHECKING:
    from tvist_client.commanded import CommandedRobot

MAX_STEP = 1000
"""Largest number of set-points in one `simulation.step`, and number of ticks that every server accepts at once."""
LONGEST_STEP = 100_000
"""Largest number of ticks in one `simulation.step`."""
TICK_S = 0.06
"""Longest duration of a tick on a slow machine [s], since a server may be slower than real time."""


class Stepper:
    """The clock of a simulated robot, which `Robot.clock_control` yields. It cannot move the robot.

    Args:
        robot: The robot it belongs to.
        token: Token of the clock.
    """

    token: str
    """Token of the clock."""

    def __init__(self, robot: "CommandedRobot", token: str) -> None:
        self.robot = robot
        self.token = token

    async def step(self, ticks: int) -> int:
        """Advance time with one command; other clients' commands are carried out between the ticks.

        Args:
            ticks: Number of control periods, 1 to 100000.

        Returns:
            The last tick that passed, which is earlier than requested if the clock was lost meanwhile; its state has
            arrived.

        Raises:
            RefusedError: The clock was lost; the message contains the present holder's name.
        """
        return await step(self.robot, self.token, ticks)

    async def advance(self, ticks: int) -> int:
        """Advance time by any number of ticks, as `Robot.advance` does."""
        return await self.robot.advance(ticks)


@contextlib.asynccontextmanager
async def hold_clock(robot: "CommandedRobot", transport: Transport, client: str) -> AsyncIterator[Stepper]:
    """Hold the clock for the duration of a block; see `Robot.clock_control`.

    Args:
        robot: Robot to step.
        transport: The robot's transport; the client is announced there first, so that the clock is free if it
            disconnects.
        client: Name of the client.
    """
    check_client_name(client)
    async with granted(
        robot, transport, TakeClock(client=client), lambda token: ReleaseClock(token=token)
    ) as grant:
        yield Stepper(robot, grant.token)


async def step(
    robot: "CommandedRobot",
    token: str,
    ticks: int,
    setpoints: Sequence[StepSetpoint] | None = None,
    motion_token: str | None = None,
) -> int:
    """Send one `simulation.step`, and wait for the state of its last tick.

    Args:
        robot: Robot to step.
        token: Token of the clock, or of the lease if no client holds the clock.
        ticks: Number of control periods, 1 to 100000.
        setpoints: Set-points of a running stream in order, one per tick.
        motion_token: Token of the lease, if there are set-points and `token` is that of the clock.

    Returns:
        The last tick that passed; its state has arrived.
    """
    robot.watch()
    ticks = whole(ticks, "ticks", 1, LONGEST_STEP)
    played = None if setpoints is None else tuple(setpoints)
    command = SimulationStep(token=token, ticks=ticks, setpoints=played, motion_token=motion_token)
    reply = await robot.request(command, TICK_S * max(ticks, MAX_STEP))
    if not isinstance(reply, Done) or reply.tick is None:
        raise UnexpectedReplyError(f"simulation.step was answered by {reply}, without a tick")
    await robot.until(reply.tick)
    return reply.tick
