"""Time of a simulated robot that does not tick by itself, and the right to let it pass."""

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
"""Set-points that one `simulation.step` may have, and ticks that every server takes at once."""
LONGEST_STEP = 100_000
"""Ticks that one may have."""
TICK_S = 0.06
"""How long a tick may take on the slowest of machines [s]: a server may compute more slowly than time passes."""


class Stepper:
    """The clock of a simulated robot: what `Robot.clock_control` gives. It moves nothing.

    Attributes:
        robot: The robot it belongs to.
        token: Token of the clock.
    """

    def __init__(self, robot: "CommandedRobot", token: str) -> None:
        self.robot = robot
        self.token = token

    async def step(self, ticks: int) -> int:
        """Let ticks pass by one command; what other clients send meanwhile is carried out between them.

        Args:
            ticks: Number of control periods, 1 to 100000.

        Returns:
            The last tick that passed; its state has arrived. It is an earlier one where the clock was lost meanwhile.

        Raises:
            RefusedError: The clock was lost; the present holder's name is in the sentence.
        """
        return await step(self.robot, self.token, ticks)

    async def advance(self, ticks: int) -> int:
        """Let any number of ticks pass, as `Robot.advance` does."""
        return await self.robot.advance(ticks)


@contextlib.asynccontextmanager
async def hold_clock(robot: "CommandedRobot", transport: Transport, client: str) -> AsyncIterator[Stepper]:
    """Hold the clock for as long as the block lasts; see `Robot.clock_control`.

    Args:
        robot: Robot to step.
        transport: The robot's; the client is announced there first, so that its going gives the clock back.
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
