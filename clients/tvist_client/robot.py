"""A robot over the network, and the rights that a client can hold on it: control and the clock."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from types import TracebackType
from typing import Self

from tvist_client.arm import Arm
from tvist_client.command import Leased
from tvist_client.connection import Connection, step
from tvist_client.errors import ClientError, NotConnectedError, UnexpectedReplyError
from tvist_client.transports.base import Transport
from tvist_client.transports.certificates import Folder
from tvist_client.transports.zenoh import ZenohTransport
from tvist_client.values import number
from tvist_protocol import Accepted, RefusedError, ReleaseClock, ReleaseControl, TakeClock, TakeControl
from tvist_protocol.channels import tag
from tvist_protocol.keys import check_client_name

ENDPOINT = "tcp/127.0.0.1:7447"
NAME = "ur5e"


class Stepper(Leased):
    """The clock of a simulated robot, which `Robot.clock_control` yields. It cannot move the robot."""

    robot: Connection

    def __init__(self, robot: Connection, token: str) -> None:
        self.robot, self.token = robot, token

    async def step(self, ticks: int) -> int:
        """Advance time with one command; other clients' commands are carried out between the ticks.

        Args:
            ticks: Number of control periods, 1 to 100000.

        Returns:
            The last tick that passed, earlier than requested if the clock was lost meanwhile; its state has arrived.

        Raises:
            RefusedError: The clock was lost; the message contains the present holder's name.
        """
        return await step(self.robot, self.token, ticks)

    async def advance(self, ticks: int) -> int:
        """Advance time by any number of ticks, as `Robot.advance` does."""
        return await self.robot.advance(ticks)


class Robot(Connection):
    """One robot, over an open transport, which `close` closes."""

    arm: Arm | None
    stepper: Stepper | None

    @classmethod
    async def connect(
        cls,
        endpoint: str = ENDPOINT,
        name: str = NAME,
        *,
        security: Folder | None = None,
        namespace: str = "",
    ) -> Self:
        """Connect over Zenoh and check that the robot answers.

        Args:
            endpoint: Endpoint of the server, or of a router it is connected to, `tcp/<host>:<port>`.
            name: Name of the robot.
            security: Folder with this client's certificate, made by `tvist keys`; the endpoint is then
                `tls/<host>:<port>`.
            namespace: Namespace of the robot, if it has one.

        Raises:
            NotConnectedError: No server listens there, the certificate is rejected, or no robot of that name
                is visible.
            RefusedError: The robot is still starting, code `starting`.
        """
        robot = cls(await ZenohTransport.open(endpoint, name, security, namespace))
        try:
            await robot.info()
        except BaseException:
            await robot.close()
            raise
        return robot

    @classmethod
    def over(cls, transport: Transport) -> Self:
        """Use a robot over any open transport, which `close` closes."""
        return cls(transport)

    async def close(self) -> None:
        """Close the connection, which also ends iterators."""
        closed = NotConnectedError("the connection was closed")
        for feed in self._feeds:
            feed.end(closed, closed=True)
        self.motions.fail(closed)
        await self._transport.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    @asynccontextmanager
    async def control(self, client: str, *, lease_s: float = 30.0) -> AsyncIterator[Arm]:
        """Hold control for the duration of a block.

        The client's presence is announced first, so that control ends at once if it disconnects; in real time
        the lease is renewed in the background.

        Args:
            client: Name of this client, shown to others.
            lease_s: Duration of control without renewal [s].

        Raises:
            RefusedError: Another client has control; the message contains its name.
            ProtocolError: `client` is not a valid client name.
        """
        take = TakeControl(client=check_client_name(client), lease_s=number(lease_s, "lease_s"))
        realtime = await self.clock() == "realtime"
        async with self._granted(take, ReleaseControl) as (token, granted_s):
            arm = self.arm = Arm(self, token)
            alive = None
            if realtime:
                alive = asyncio.create_task(arm.keep_alive_every((granted_s or take.lease_s) / 3))
            try:
                yield arm
            finally:
                self.arm = None if self.arm is arm else self.arm
                if alive is not None:
                    alive.cancel()
                    await asyncio.wait([alive])

    @asynccontextmanager
    async def clock_control(self, client: str) -> AsyncIterator[Stepper]:
        """Hold the clock for the duration of a block, so that time passes only by this client's steps.

        This works in lockstep and free. It is independent of control, which another client may have at the same time.

        Args:
            client: Name of this client, shown to others; the clock is released when it disconnects.

        Raises:
            RefusedError: Another client holds the clock (the message has its name), or time passes by itself.
            ProtocolError: `client` is not a valid client name.
        """
        async with self._granted(TakeClock(client=check_client_name(client)), ReleaseClock) as (token, _):
            stepper = self.stepper = Stepper(self, token)
            try:
                yield stepper
            finally:
                self.stepper = None if self.stepper is stepper else self.stepper

    @asynccontextmanager
    async def _granted(
        self, take: TakeControl | TakeClock, release: type[ReleaseControl | ReleaseClock]
    ) -> AsyncIterator[tuple[str, float | None]]:
        """Hold a right for the duration of a block; yield its token and its duration without renewal [s]."""
        with self._transport.presence(take.client):
            accepted = await self.request(take)
            if not isinstance(accepted, Accepted) or accepted.token is None:
                raise UnexpectedReplyError(f"{tag(type(take))} was answered by {accepted}, without a token")
            try:
                yield accepted.token, accepted.lease_s
            finally:
                # If the right is lost or the robot has disconnected, there is nothing to release.
                with suppress(RefusedError, ClientError):
                    await self.request(release(token=accepted.token))
