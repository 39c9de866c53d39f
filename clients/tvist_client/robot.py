"""A robot as a client sees it: its description, its messages, and control over it."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import TracebackType
from typing import Self

from tvist_client.arm import Arm, hold_control
from tvist_client.commanded import Answer
from tvist_client.errors import MisuseError, NotConnectedError, UnexpectedReplyError
from tvist_client.kinematics import Kinematics
from tvist_client.motion import Motion, MotionsByNumber
from tvist_client.published import STATE_S, Published
from tvist_client.stepper import MAX_STEP, Stepper, hold_clock
from tvist_client.transports.base import Transport
from tvist_client.transports.certificates import Folder
from tvist_client.transports.zenoh import ZenohTransport
from tvist_client.understood import understood
from tvist_client.values import whole
from tvist_protocol.codec import decode_info, decode_reply, encode
from tvist_protocol.commands import Command, Stop
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Clock, Info
from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Refused
from tvist_protocol.stream import State

ENDPOINT = "tcp/127.0.0.1:7447"
NAME = "ur5e"
ANSWER_S = 10.0
"""Longest wait for the answer to a command [s]."""
CHUNK = 50
"""Ticks to step between two checks whether a motion has ended: a tenth of a second."""


class Robot(Published, Kinematics):
    """One robot, over an open transport, which `close` closes.

    Args:
        transport: The transport.
    """

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport)
        self._transport = transport
        self._clock: Clock | None = None
        self.arm: Arm | None = None
        """The arm, while this client has control."""
        self.stepper: Stepper | None = None
        """The clock, while this client holds it."""
        self.motions = MotionsByNumber(self._until_ended)
        """Motions by number, this client's and others'."""
        # Listen before any command is sent, since an event may precede the answer.
        self._events.listen(self.motions.on_event)
        transport.on_lost(self._on_lost)

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
            namespace: Namespace of the robot, if it is served in one.

        Raises:
            NotConnectedError: No server listens there, the certificate is rejected, or no robot of that name is there
                or visible.
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
        for feed in self._feeds:
            feed.finish()
        self.motions.fail(NotConnectedError("the connection was closed"))
        await self._transport.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    # ------------------------------------------------------------------ description and messages

    async def info(self) -> Info:
        """Request the robot's description and settings.

        Raises:
            RefusedError: The robot is still starting; the message says how far that is.
        """
        data = await self._transport.info()
        try:
            info = understood(decode_info, data)
        except UnexpectedReplyError:
            if isinstance(reply := understood(decode_reply, data), Refused):
                raise RefusedError(reply) from None
            raise
        self._clock = info.clock
        return info

    async def clock(self) -> Clock:
        """What advances simulation time; requested only once."""
        return self._clock or (await self.info()).clock

    async def state(self) -> State:
        """Return the present state: in real time the next one to arrive, otherwise the last one.

        Before the first tick, the state describes the arm at rest. In lockstep the first call may take a second.

        Raises:
            AnswerTimeoutError: No state arrived within `STATE_S`.
            MisuseError: An in-process host other than this project's publishes no state before its first tick.
            NotConnectedError: The connection is closed, or the robot has disconnected.
        """
        self._states.subscribe()
        clock = await self.clock()
        if clock != "realtime" and self._states.latest is not None:
            return self._states.latest
        if clock == "free":
            raise MisuseError(
                "this robot sends its state from the first tick on: take control and call advance(1)"
            )
        return await self._next_state()

    # ------------------------------------------------------------------ commands

    async def request(self, command: Command, timeout_s: float = ANSWER_S) -> Answer:
        """Send any command.

        Args:
            command: The command, with its token if it has one.
            timeout_s: How long the robot may take [s].

        Raises:
            RefusedError: The robot refused it, which changed nothing.
            NotConnectedError: The robot does not answer.
            DeniedError: This client's certificate is not an operator's.
            AnswerTimeoutError: No answer came in time.
            ProtocolError: The command contains a value that cannot be sent.
        """
        reply = understood(decode_reply, await self._transport.request(encode(command), timeout_s))
        if isinstance(reply, Refused):
            raise RefusedError(reply)
        return reply

    def watch(self) -> None:
        """Start to receive the states, before a command causes one."""
        self._states.subscribe()

    def put_setpoint(self, data: bytes) -> None:
        """Send an encoded set-point, as `Arm.servo` does."""
        self._transport.put_setpoint(data)

    async def stop(self) -> None:
        """Bring the arm to rest now; no control is needed."""
        await self.request(Stop())

    @asynccontextmanager
    async def control(self, client: str, *, lease_s: float = 30.0) -> AsyncIterator[Arm]:
        """Hold control for the duration of a block.

        The client's presence is announced first, so that control ends at once if it disconnects; in real time the
        lease is renewed in the background.

        Args:
            client: Name of this client, shown to others.
            lease_s: How long control lasts without renewal [s].

        Raises:
            RefusedError: Another client has control; the message contains its name.
            ProtocolError: `client` is not a valid client name.
        """
        async with hold_control(self, self._transport, client, lease_s) as arm:
            self.arm = arm
            try:
                yield arm
            finally:
                self.arm = None if self.arm is arm else self.arm

    # ------------------------------------------------------------------ time

    @asynccontextmanager
    async def clock_control(self, client: str) -> AsyncIterator[Stepper]:
        """Hold the clock for the duration of a block, so that time passes only by this client's steps.

        This works in lockstep and free. It is independent of control, which another client may have at the same time.

        Args:
            client: Name of this client, shown to others; the clock is released when it disconnects.

        Raises:
            RefusedError: Another client holds the clock, whose name is in the message; or time passes by itself.
            ProtocolError: `client` is not a valid client name.
        """
        async with hold_clock(self, self._transport, client) as stepper:
            self.stepper = stepper
            try:
                yield stepper
            finally:
                self.stepper = None if self.stepper is stepper else self.stepper

    @property
    def clock_token(self) -> str | None:
        """Token of the clock; None if this client does not hold it."""
        return None if self.stepper is None else self.stepper.token

    async def advance(self, ticks: int) -> int:
        """Advance time: by steps in lockstep and free, by waiting in real time.

        Args:
            ticks: Number of control periods, at least 1.

        Returns:
            The last tick that passed; its state has arrived.

        Raises:
            ArgumentError: `ticks` is less than 1, or not an integer.
            MisuseError: Not in real time, and this client has neither the clock nor control.
            RefusedError: Another client holds the clock; the message contains its name.
        """
        ticks = whole(ticks, "ticks", 1)
        if await self.clock() == "realtime":
            return await self._see_pass(ticks)
        by = self.stepper or self.arm
        if by is None:
            raise MisuseError(
                "only a client with `robot.clock_control(…)`, or else `robot.control(…)`, can step this robot's time"
            )
        tick = 0
        for first in range(0, ticks, MAX_STEP):
            tick = await by.step(min(MAX_STEP, ticks - first))
        return tick

    async def pass_time(self, ticks: int) -> None:
        """Let ticks pass as `advance` does, or wait for them if another client steps."""
        if await self._let_pass(ticks) is None:
            await self._see_pass(ticks)

    async def until(self, tick: int) -> State:
        """Wait until the state of a tick has arrived, without stepping time."""
        self._states.subscribe()
        latest = self._states.latest
        if latest is not None and latest.tick >= tick:
            return latest
        return await self._states.next(lambda state: state.tick >= tick, STATE_S)

    async def rest(self) -> State:
        """Step time until the shaped reference is at rest, or wait if another client steps; the arm may still vibrate.

        Returns:
            The first state received in which it is at rest.
        """
        while True:
            tick = await self._let_pass(CHUNK)
            state = await (self._next_state() if tick is None else self.until(tick))
            if state.runtime_state == RuntimeState.STOPPED:
                return state

    async def _until_ended(self, motion: Motion) -> None:
        while not motion.ended:
            if await self._let_pass(CHUNK) is None:
                await motion.wait_event()

    async def _see_pass(self, ticks: int) -> int:
        """Wait until ticks have passed, counted from the next state; return the last one."""
        last = (await self._next_state()).tick + ticks
        while (tick := (await self._next_state()).tick) < last:
            pass
        return tick

    async def _let_pass(self, ticks: int) -> int | None:
        """Step time; return None if this client cannot: in real time, or if another client holds the clock."""
        if await self.clock() == "realtime":
            return None
        try:
            return await self.advance(ticks)
        except RefusedError:
            if self.stepper is not None or (await self.info()).stepper is None:
                raise
            return None

    def _on_lost(self, error: NotConnectedError) -> None:
        for feed in self._feeds:
            feed.fail(error)
        self.motions.fail(error)
