"""Moves a robot for ROS 2, with control only while it moves."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress

from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_client.robot import Robot
from tvist_protocol import StopJ, TrajectoryPoint, TvistError
from tvist_ros2.tasks import Tasks

CLIENT = "ros2"  # name of the client that takes control
LOOKAHEAD = 0.03  # lag behind position commands, the smallest that a robot offers [s]
PAUSE_TICKS = 500  # ticks without position commands after which they are followed again after a stop: 1 s

Warn = Callable[[str], None]  # tells people what was refused, or why something ended


class Mover:
    """Follows position commands and carries out trajectories; the robot refuses what does not go together."""

    def __init__(self, robot: Robot, warn: Warn) -> None:
        self._robot, self._warn = robot, warn
        self._changing = asyncio.Lock()  # held while control is taken or given back
        self._held, self._users = AsyncExitStack(), 0
        self._tasks = Tasks()
        self._following = False
        self._stopped = False  # whether position commands are ignored until they pause
        self._commanded = 0  # tick of the latest position command
        self._target: Sequence[float] | None = None
        self._news = asyncio.Event()

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
        """Follow a posture until the arm rests there, or until the next one.

        After a stop, nobody expects the arm to move because commands go on: they must pause first.
        """
        self._stopped = self._stopped and tick < self._commanded + PAUSE_TICKS
        self._commanded = tick
        if self._stopped:
            return
        self._target = q
        self._news.set()
        if not self._following:
            self._following = True
            self._tasks.start(self._follow())

    async def begin(self, points: Sequence[TrajectoryPoint]) -> Motion:
        """Start a trajectory; return its motion. RefusedError names the first bad point."""
        async with AsyncExitStack() as held:
            arm = await held.enter_async_context(self.control())
            motion = await arm.move_trajectory(points, wait=False)
            self._tasks.start(self._hold(held.pop_all(), motion))
        return motion

    def stop(self) -> None:
        """Bring the arm to rest on the path of its motion."""
        self._tasks.start(self._stop())

    async def close(self) -> None:
        """End all motions, because control ends."""
        await self._tasks.cancel()

    async def _stop(self) -> None:
        if self._robot.arm is not None:
            # Not `stop_j` of the arm, which would step the time of a robot in lockstep.
            with suppress(TvistError):  # it is stopping already
                await self._robot.request(StopJ(token=self._robot.arm.token))

    async def _hold(self, control: AsyncExitStack, motion: Motion) -> None:
        async with control:
            await motion.wait_event()

    async def _follow(self) -> None:
        motion: Motion | None = None
        forget = self._robot.on_event(lambda _: self._news.set())
        async with AsyncExitStack() as held:
            try:
                arm = await held.enter_async_context(self.control())
                while True:
                    self._news.clear()
                    q, self._target = self._target, None
                    if motion is not None and motion.ended and (q is None or motion.stopped is not None):
                        break
                    if q is None:
                        await self._news.wait()
                    else:
                        motion = await self._aim(arm, q, motion)
                if motion.stopped is not None:
                    self._stopped = True
                    again = "they are followed again once they have paused for 1 s"
                    self._warn(f"position commands were stopped: {motion.stopped.why}; {again}")
            except TvistError as error:
                self._target = None
                self._warn(f"a position command was refused: {error}")
            finally:
                self._following = False  # before control is given back, so that a command starts anew
                forget()

    async def _aim(self, arm: Arm, q: Sequence[float], motion: Motion | None) -> Motion:
        """Follow a posture; if it is refused, the motion before continues."""
        try:
            return await arm.servo_j(q, lookahead=LOOKAHEAD, shaped=True)
        except TvistError as error:
            if motion is None:
                raise
            self._warn(f"a position command was refused: {error}")
            return motion
