"""Rights on a robot, control or the clock, held for the duration of a block."""

import contextlib
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, NamedTuple

from tvist_client.errors import ClientError, UnexpectedReplyError
from tvist_client.transports.base import Transport
from tvist_protocol.channels import tag
from tvist_protocol.commands import Command, TakeClock, TakeControl
from tvist_protocol.errors import RefusedError
from tvist_protocol.replies import Accepted

if TYPE_CHECKING:
    from tvist_client.commanded import CommandedRobot


class Grant(NamedTuple):
    """A right that the robot has given."""

    token: str
    lease_s: float | None
    """How long it lasts without renewal [s]; None if it does not expire."""


@contextlib.asynccontextmanager
async def granted(
    robot: "CommandedRobot",
    transport: Transport,
    take: TakeControl | TakeClock,
    release: Callable[[str], Command],
) -> AsyncIterator[Grant]:
    """Hold a right for the duration of a block.

    Args:
        robot: Robot that grants it.
        transport: The robot's transport; the client is announced there first, so that the right ends if it
            disconnects.
        take: Command that requests the right.
        release: Creates the command that gives it back, from its token.

    Raises:
        RefusedError: Another client holds it.
        UnexpectedReplyError: The answer has no token.
    """
    await transport.announce(take.client)
    try:
        accepted = await robot.request(take)
        if not isinstance(accepted, Accepted) or accepted.token is None:
            raise UnexpectedReplyError(f"{tag(type(take))} was answered by {accepted}, without a token")
        try:
            yield Grant(accepted.token, accepted.lease_s)
        finally:
            # If the right is lost or the robot has disconnected, there is nothing to release.
            with contextlib.suppress(RefusedError, ClientError):
                await robot.request(release(accepted.token))
    finally:
        await transport.withdraw(take.client)
