"""An arm under control: everything that only the client in control may do."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from tvist_client.errors import (
    AnswerTimeoutError,
    ClientError,
    ProtectiveStopError,
)
from tvist_client.forces import Forces
from tvist_client.granted import granted
from tvist_client.guiding import Guiding
from tvist_client.moves import Moves
from tvist_client.payload import make_payload
from tvist_client.servo import Servo
from tvist_client.simulation import Simulation
from tvist_client.terminals import Terminals
from tvist_client.transports.base import Transport
from tvist_client.values import JointRange, floats, number, pose_of, whole
from tvist_protocol.commands import (
    Forget,
    HandOver,
    KeepAlive,
    Pause,
    PowerOff,
    PowerOn,
    ReleaseControl,
    RestartSafety,
    Resume,
    ServoStart,
    ServoStop,
    SetEstimator,
    SetPayload,
    SetShaper,
    SetSpeed,
    Stop,
    TakeControl,
    UnlockProtectiveStop,
)
from tvist_protocol.errors import RefusedError
from tvist_protocol.io import SetTcp
from tvist_protocol.keys import check_client_name
from tvist_protocol.programs import (
    ProgramClosePopup,
    ProgramLoad,
    ProgramPause,
    ProgramPlay,
    ProgramRun,
    ProgramStop,
)
from tvist_protocol.stream import Event

if TYPE_CHECKING:
    from tvist_client.commanded import CommandedRobot

log = logging.getLogger(__name__)

UNLOCKED_TICKS = 150
"""Ticks (0.3 s) for which a robot is observed after unlocking; an overloaded drive stops within hundredths of a
second.
"""


class Arm(Moves, Guiding, Forces, Terminals, Simulation):
    """The arm that `Robot.control` yields. Joint values are any sequence of numbers [rad], one for each joint.

    Every command may raise RefusedError; it has then changed nothing.
    """

    # ------------------------------------------------------------------ motion

    @contextlib.asynccontextmanager
    async def servo(
        self,
        *,
        period: float = 0.002,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
    ) -> AsyncIterator[Servo]:
        """Stream set-points for as long as the block lasts; then the stream ends and the arm comes to rest.

        Args:
            period: Time between two set-points [s].
            velocity: Velocity to which every joint is limited [rad/s].
            acceleration: Acceleration to which every joint is limited [rad/s²].
            jerk: Jerk to which every joint is limited [rad/s³].
        """
        joints = JointRange(await self.robot.info())
        every = number(period, "period")
        start = ServoStart(
            token=self.token,
            period=every,
            velocity=number(velocity, "velocity"),
            acceleration=number(acceleration, "acceleration"),
            jerk=number(jerk, "jerk"),
        )
        servo = Servo(self, every, joints)
        with servo:  # receives the event of the stream's end, which may precede the answer
            await self.robot.request(start)
            try:
                yield servo
            except BaseException:
                # The error that ends the block is more informative than a refusal to end a stream that has ended.
                with contextlib.suppress(RefusedError, ClientError):
                    await self.robot.request(ServoStop(token=self.token))
                raise
            servo.check()
        await self.robot.request(ServoStop(token=self.token))
        await self.robot.rest()

    async def stop(self, deceleration: float | None = None) -> None:
        """Come to rest now, bypassing the shaper.

        Args:
            deceleration: Largest deceleration of any joint [rad/s²]; None for as much as the torque limits allow.
        """
        limit = None if deceleration is None else number(deceleration, "deceleration")
        await self.robot.request(Stop(token=self.token, deceleration=limit))

    async def pause(self) -> None:
        """Bring the running motion to a standstill on its path."""
        await self.robot.request(Pause(token=self.token))

    async def resume(self) -> None:
        """Continue a paused motion."""
        await self.robot.request(Resume(token=self.token))

    async def set_speed(self, fraction: float) -> None:
        """Scale the speed of motions, as the slider of a teach pendant does; streams keep their own time.

        Args:
            fraction: Share of the programmed speed, 0 to 1 [-].
        """
        await self.robot.request(SetSpeed(token=self.token, fraction=number(fraction, "fraction")))

    # ------------------------------------------------------------------ power and protective stops

    async def power_on(self, *, release_brakes: bool = True) -> None:
        """Power on the arm; without `release_brakes`, the brakes of an arm that was off stay closed."""
        await self.robot.request(PowerOn(token=self.token, release_brakes=release_brakes))

    async def power_off(self) -> None:
        """Stop any motion, then power off the arm."""
        await self.robot.request(PowerOff(token=self.token))

    async def unlock_protective_stop(self) -> None:
        """Unlock a protective stop; the arm must be at rest.

        In real time, wait for `UNLOCKED_TICKS` to see that the robot does not stop again. In lockstep and free, the
        caller advances time: a new stop is then reported as an event, and as `stop` in `Robot.info`.

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
            # The event of the unlocked stop may still be on its way; its tick is the next one at the latest.
            before = (await self.robot.info()).tick + 1
            await self.robot.request(unlock)
            await self.robot.advance(UNLOCKED_TICKS)
        finally:
            forget()
        for event in stops:
            if event.tick > before:
                raise ProtectiveStopError(event)

    async def restart_safety(self) -> None:
        """Restart the safety system after a violation or a fault; afterwards the arm has no power."""
        await self.robot.request(RestartSafety(token=self.token))

    # ------------------------------------------------------------------ programs

    async def load_program(self, name: str, text: str | None = None) -> None:
        """Load a program; a running program and the arm are stopped first.

        Args:
            name: Its name: one of `programs` in `info`, or any other if `text` is given.
            text: Its text in URScript, which the robot keeps under this name; None for the one it has.
        """
        await self.robot.request(ProgramLoad(token=self.token, name=name, text=text))

    async def run_program(self, text: str) -> None:
        """Start a program in URScript at once; it replaces a running one, unless it is secondary (`sec`)."""
        await self.robot.request(ProgramRun(token=self.token, text=text))

    async def close_popup(self) -> None:
        """Close the message that a program shows, for which it may be waiting."""
        await self.robot.request(ProgramClosePopup())

    async def play_program(self) -> None:
        """Start the loaded program, or resume a paused one. `io` reports its progress; it ends with control."""
        await self.robot.request(ProgramPlay(token=self.token))

    async def pause_program(self) -> None:
        """Pause the program and its motion; `play_program` resumes it."""
        await self.robot.request(ProgramPause(token=self.token))

    async def stop_program(self) -> None:
        """Stop the program, and the arm with it."""
        await self.robot.request(ProgramStop(token=self.token))

    # ------------------------------------------------------------------ setting up

    async def set_shaper(self, name: str, modes: int = 1) -> None:
        """Choose the input shaper, one of those in `info`; `none` turns shaping off."""
        await self.robot.request(SetShaper(token=self.token, name=name, modes=whole(modes, "modes", 1)))

    async def set_estimator(
        self,
        name: str,
        *,
        f_d: float | Iterable[float] | None = None,
        zeta: float | Iterable[float] | None = None,
        calibration: str | Mapping[str, Any] | None = None,
    ) -> None:
        """Choose the estimator that provides the shaper with frequency and damping ratio.

        Args:
            name: `fixed` with `f_d` and `zeta`, `polynomial` or `modal` with `calibration`.
            f_d: Damped frequency of each mode [Hz]; a single number for one mode.
            zeta: Damping ratio of each mode [-]; a single number for one mode.
            calibration: Name of a calibration in `info`, or its content as a map.
        """
        await self.robot.request(
            SetEstimator(
                token=self.token,
                name=name,
                f_d=_modes(f_d, "f_d"),
                zeta=_modes(zeta, "zeta"),
                calibration=dict(calibration) if isinstance(calibration, Mapping) else calibration,
            )
        )

    async def set_payload(self, mass: float, com: Iterable[float], inertia: Iterable[float]) -> None:
        """Declare the payload to the controller.

        Args:
            mass: Mass [kg].
            com: Centre of mass x y z in the flange frame [m].
            inertia: xx xy xz yy yz zz about the centre of mass, flange axes [kg m²].
        """
        believed = make_payload(mass, com, inertia)
        await self.robot.request(
            SetPayload(token=self.token, mass=believed.mass, com=believed.com, inertia=believed.inertia)
        )

    async def forget(self) -> None:
        """Undo what the robot has learnt of its payload: it assumes the declared one again.

        A robot served with `--adapt payload` learns it anew.
        """
        await self.robot.request(Forget(token=self.token, what="payload"))

    async def set_tcp(self, offset: Iterable[float]) -> None:
        """Set the tool centre point.

        Args:
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        await self.robot.request(SetTcp(token=self.token, offset=pose_of(offset, "offset")))

    # ------------------------------------------------------------------ lease

    async def hand_over(self, client: str) -> None:
        """Give control to another client, which only has to take it; this client loses control."""
        await self.robot.request(HandOver(token=self.token, client=client))

    async def keep_alive(self) -> None:
        """Renew the lease, as every command does; `Robot.control` does this automatically."""
        await self.robot.request(KeepAlive(token=self.token))

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


@contextlib.asynccontextmanager
async def hold_control(
    robot: "CommandedRobot", transport: Transport, client: str, lease_s: float
) -> AsyncIterator[Arm]:
    """Hold control for as long as the block lasts; see `Robot.control`.

    Args:
        robot: Robot to control.
        transport: The robot's transport; the client is announced there first.
        client: Name of the client.
        lease_s: How long control lasts without renewal [s].
    """
    check_client_name(client)
    seconds = number(lease_s, "lease_s")
    clock = await robot.clock()
    take = TakeControl(client=client, lease_s=seconds)
    async with granted(robot, transport, take, lambda token: ReleaseControl(token=token)) as grant:
        arm = Arm(robot, grant.token)
        alive = None
        if clock == "realtime":
            alive = asyncio.create_task(arm.keep_alive_every((grant.lease_s or seconds) / 3))
        try:
            yield arm
        finally:
            if alive is not None:
                alive.cancel()
                await asyncio.wait([alive])


def _modes(values: float | Iterable[float] | None, where: str) -> tuple[float, ...] | None:
    if values is None:
        return None
    return floats(values, where) if isinstance(values, Iterable) else (number(values, where),)
