"""Moves a robot for ROS 2, with control only while it moves."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress

from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_client.robot import Robot
from tvist_protocol import Event, RefusedError, StopJ, TrajectoryPoint, TvistError
from tvist_ros2.tasks import Tasks

CLIENT = "ros2"  # name of the client that takes control
LOOKAHEAD = 0.03  # lag behind position commands, the smallest that a robot offers [s]
PAUSE_TICKS = 500  # ticks without position commands after which they are followed again: 1 s
STOPS = {"motion_stopped", "protective_stop", "safety_stop"}  # events after which they are ignored
NOT_NOW = {"busy", "no_control", "wrong_mode"}  # codes of refusals after which they are

Warn = Callable[[str], None]  # tells people what was refused, or why something ended


class Mover:
    """Follows position commands and carries out trajectories; the robot refuses what does not go together."""

    def __init__(self, robot: Robot, warn: Warn) -> None:
        self._robot, self._warn = robot, warn
        self._changing = asyncio.Lock()  # held while control is taken or given back
        self._held, self._users = AsyncExitStack(), 0
        self._tasks = Tasks()
        self._following = False
        self._ignoring = False  # whether position commands are ignored until they pause
        self._commanded = 0  # tick of the latest position command
        self._target: Sequence[float] | None = None
        self._news = asyncio.Event()
        self._program_ended = asyncio.Event()
        robot.on_event(self._on_event)

    @asynccontextmanager
    async def control(self) -> AsyncIterator[Arm]:
        """Share control for the duration of a block; RefusedError if another client has it."""
        async with self._changing:
            if self._users == 0:
                await self._held.enter_async_context(self._robot.control(CLIENT))
            self._users += 1
            arm = self._robot.arm
        assert arm is not None
        try:
            yield arm
        finally:
            async with self._changing:
                self._users -= 1
                if self._users == 0:
                    await self._held.aclose()

    def follow(self, q: Sequence[float], tick: int) -> None:
        """Follow a posture until the arm rests there, or until the next one."""
        self._ignoring = self._ignoring and tick < self._commanded + PAUSE_TICKS
        self._commanded = tick
        if self._ignoring:
            return
        self._target = q
        self._news.set()
        if not self._following:
            self._following = True
            self._tasks.start(self._follow())

    def ignore_positions(self) -> None:
        """Ignore position commands until they pause: after a stop, the arm must not move because they go on."""
        self._ignoring = True

    async def begin(self, points: Sequence[TrajectoryPoint]) -> Motion:
        """Start a trajectory; return its motion. RefusedError names the first bad point."""
        async with AsyncExitStack() as held:
            arm = await held.enter_async_context(self.control())
            motion = await arm.move_trajectory(points, wait=False)
            self._tasks.start(_hold(held.pop_all(), motion.wait_event()))
        return motion

    async def play(self) -> None:
        """Start the loaded program, and keep control until it ends."""
        async with AsyncExitStack() as held:
            arm = await held.enter_async_context(self.control())
            self._program_ended.clear()
            await arm.play_program()
            self._tasks.start(_hold(held.pop_all(), self._program_ended.wait()))

    def stop(self) -> None:
        """Bring the arm to rest on the path of its motion."""
        self._tasks.start(self._stop())

    async def close(self) -> None:
        """End all motions, because control ends."""
        await self._tasks.cancel()

    def _on_event(self, event: Event) -> None:
        self._news.set()
        if event.kind in STOPS:
            self.ignore_positions()
        elif event.kind == "program_stopped":
            self._program_ended.set()

    async def _stop(self) -> None:
        if self._robot.arm is not None:
            # Not `stop_j` of the arm, which would step the time of a robot in lockstep.
            with suppress(TvistError):  # it is stopping already
                await self._robot.request(StopJ(token=self._robot.arm.token))

    async def _follow(self) -> None:
        motion: Motion | None = None
        async with AsyncExitStack() as held:
            try:
                arm = await held.enter_async_context(self.control())
                while motion is None or motion.stopped is None:
                    self._news.clear()
                    q, self._target = self._target, None
                    if q is not None:
                        motion = await self._aim(arm, q) or motion
                    elif motion is None or motion.ended:
                        return
                    else:
                        await self._news.wait()
                again = "they are followed again once they have paused for 1 s"
                self._warn(f"position commands were stopped: {motion.stopped.why}; {again}")
            except TvistError as error:
                self._refused(error)
            finally:
                self._following = False  # before control is given back, so that a command starts anew

    async def _aim(self, arm: Arm, q: Sequence[float]) -> Motion | None:
        """Follow a posture; None if it is refused, so that the motion before continues."""
        try:
            return await arm.servo_j(q, lookahead=LOOKAHEAD, shaped=True)
        except TvistError as error:
            self._refused(error)
            return None

    def _refused(self, error: TvistError) -> None:
        if isinstance(error, RefusedError) and error.reply.code in NOT_NOW:
            self.ignore_positions()
            self._target = None
        self._warn(f"a position command was refused: {error}")


async def _hold(control: AsyncExitStack, ended: Awaitable[object]) -> None:
    async with control:
        await ended
