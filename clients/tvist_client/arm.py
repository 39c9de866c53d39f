"""An arm under control, and what only the client in control may do."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Sequence

from tvist_client.arguments import built
from tvist_client.commands import Commands
from tvist_client.connection import Connection, step
from tvist_client.errors import AnswerTimeoutError, ClientError, ProtectiveStopError
from tvist_client.servo import Servo
from tvist_client.values import number as number_of
from tvist_client.values import whole
from tvist_protocol.commands import ServoStart, ServoStop, UnlockProtectiveStop
from tvist_protocol.errors import RefusedError
from tvist_protocol.io import SetIo, SimulationSetInputs
from tvist_protocol.simulation import StepSetpoint
from tvist_protocol.stream import Event

log = logging.getLogger(__name__)

UNLOCKED_TICKS = 150
"""Ticks (0.3 s) for which a robot is observed after unlocking; an overloaded drive stops within some 10 ms."""
LAST_DIGITAL = 17
LAST_ANALOG = 1


class Arm(Commands):
    """The arm that `Robot.control` yields. Joint values are any sequence of numbers [rad], one for each joint.

    Poses are any sequence of six numbers: x y z [m] and rotation vector [rad] of the tool centre point, in
    the base frame or in `frame`. Every command may raise RefusedError; it has then changed nothing.
    """

    robot: Connection

    def __init__(self, robot: Connection, token: str) -> None:
        self.robot, self.token = robot, token

    @contextlib.asynccontextmanager
    async def servo(
        self,
        *,
        period: float = 0.002,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
    ) -> AsyncIterator[Servo]:
        """Stream set-points within the block; at its end the stream ends and the arm comes to rest.

        Args:
            period: Time between two set-points [s].
            velocity: Velocity to which every joint is limited [rad/s].
            acceleration: Acceleration to which every joint is limited [rad/s²].
            jerk: Jerk to which every joint is limited [rad/s³].
        """
        asked = {"period": period, "velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        start = built(ServoStart, asked, token=self.token)
        servo = Servo(self.robot, self.token, start.period, await self.robot.info())
        with servo:  # receives the event of the stream's end, which may precede the answer
            await self.robot.request(start)
            try:
                yield servo
            except BaseException:
                # The block's error is more informative than a refusal to end a stream that has ended.
                with contextlib.suppress(RefusedError, ClientError):
                    await self.robot.request(ServoStop(token=self.token))
                raise
            servo.check()
        await self.robot.request(ServoStop(token=self.token))
        await self.robot.rest()

    async def unlock_protective_stop(self) -> None:
        """Unlock a protective stop; the arm must be at rest.

        In real time, observe the robot for `UNLOCKED_TICKS`. In lockstep and free, the caller advances time:
        a new stop is then reported as an event, and as `stop` in `Robot.info`.

        Raises:
            ProtectiveStopError: The robot has stopped again, because the cause of the stop persists.
        """
        unlock = UnlockProtectiveStop(token=self.token)
        if await self.robot.clock() != "realtime":
            await self.robot.request(unlock)
            return
        stops: list[Event] = []
        forget = self.robot.on_event(
            lambda event: stops.append(event) if event.kind == "protective_stop" else None
        )
        try:
            # The event of the unlocked stop may still be on its way; its tick is at most the next one.
            before = (await self.robot.info()).tick + 1
            await self.robot.request(unlock)
            await self.robot.advance(UNLOCKED_TICKS)
        finally:
            forget()
        for event in stops:
            if event.tick > before:
                raise ProtectiveStopError(event)

    async def set_digital_output(self, number: int, on: bool) -> None:
        """Switch a digital output: 0–7 standard, 8–15 configurable, 16–17 tool."""
        bit = 1 << whole(number, "number", 0, LAST_DIGITAL)
        await self.robot.request(
            SetIo(token=self.token, digital_output_mask=bit, digital_outputs=bit if on else 0)
        )

    async def set_analog_output(self, number: int, share: float, *, voltage: bool = False) -> None:
        """Set an analogue output.

        Args:
            number: 0 or 1.
            share: Value as a share of the output's range [-].
            voltage: True for the range 0 to 10 V, False for 4 to 20 mA.
        """
        bit = 1 << whole(number, "number", 0, LAST_ANALOG)
        ratio = number_of(share, "share")
        await self.robot.request(
            SetIo(
                token=self.token,
                standard_analog_output_mask=bit,
                standard_analog_output_type=bit if voltage else 0,
                standard_analog_output_0=ratio,
                standard_analog_output_1=ratio,
            )
        )

    async def set_digital_input(self, number: int, on: bool) -> None:
        """Switch a digital input, as a connected device would: 0–7 standard, 8–15 configurable, 16–17 tool."""
        bit = 1 << whole(number, "number", 0, LAST_DIGITAL)
        await self.robot.request(
            SimulationSetInputs(token=self.token, digital_input_mask=bit, digital_inputs=bit if on else 0)
        )

    async def step(self, ticks: int, setpoints: Sequence[StepSetpoint] | None = None) -> int:
        """Advance time in lockstep and free with one command; `Robot.advance` takes any number of ticks.

        If this client also holds the clock (`Robot.clock_control`), the clock's token is used.

        Args:
            ticks: Number of control periods, 1 to 100000.
            setpoints: Set-points of a running stream, at most 1000, in order and one per tick;
                `Servo.step_through` numbers them.

        Returns:
            The last tick that passed; its state has arrived.
        """
        return await step(self.robot, self.token, ticks, setpoints)

    async def keep_alive_every(self, period_s: float) -> None:
        """Renew the lease periodically, until it is lost."""
        while True:
            await asyncio.sleep(period_s)
            try:
                await self.keep_alive()
            except AnswerTimeoutError as error:
                log.warning("the lease was not renewed: %s", error)
            except (RefusedError, ClientError) as error:
                log.warning("control is lost: %s", error)
                return
