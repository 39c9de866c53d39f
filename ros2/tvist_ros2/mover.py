"""Moves a robot for ROS 2: one motion at a time, with control only meanwhile."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress

from tvist_client.arm import Arm
from tvist_client.errors import MisuseError
from tvist_client.motion import Motion
from tvist_client.robot import Robot
from tvist_protocol import RefusedError, StopJ, TrajectoryPoint, TvistError

CLIENT = "ros2"  # name of the client that takes control
LOOKAHEAD = 0.03  # lag behind position commands, the smallest that a robot offers [s]

Warn = Callable[[str], None]  # tells people what was refused, or why something ended


class Mover:
    """Follows position commands, or carries out a trajectory."""

    def __init__(self, robot: Robot, warn: Warn) -> None:
        self._robot, self._warn = robot, warn
        self._turn = asyncio.Lock()
        self._arm: Arm | None = None  # while a motion is carried out
        self._task: asyncio.Task[None] | None = None
        self._target: Sequence[float] | None = None
        self._news = asyncio.Event()

    @asynccontextmanager
    async def control(self) -> AsyncIterator[Arm]:
        """Have control for the duration of a block, also during a motion; RefusedError if another client has it."""
        if self._arm is not None:
            yield self._arm
        else:
            async with self._turn, self._robot.control(CLIENT) as arm:
                yield arm

    def follow(self, q: Sequence[float]) -> None:
        """Follow a posture until the arm rests there, or until the next one."""
        self._target = q
        self._news.set()
        if self._task is None:
            self._task = asyncio.create_task(self._follow())
            self._task.add_done_callback(self._followed)

    async def begin(self, points: Sequence[TrajectoryPoint]) -> Motion:
        """Start a trajectory; return its motion. RefusedError names the first bad point."""
        if self._task is not None and self._arm is None and self._target is None:
            await asyncio.wait([self._task])  # the motion before has ended, and gives control back
        if self._task is not None or self._turn.locked():
            raise MisuseError("the arm is following another command: wait until it rests")
        async with AsyncExitStack() as stack:
            await stack.enter_async_context(self._turn)
            arm = await stack.enter_async_context(self._robot.control(CLIENT))
            motion = await arm.move_trajectory(points, wait=False)
            self._arm = arm
            self._task = asyncio.create_task(self._until_ended(motion, stack.pop_all()))
        return motion

    async def stop(self) -> None:
        """Come to rest on the path of the trajectory."""
        if self._arm is not None:
            # Not `stop_j` of the arm, which would step the time of a robot in lockstep.
            with suppress(RefusedError):  # it is stopping already
                await self._robot.request(StopJ(token=self._arm.token))

    async def close(self) -> None:
        """End the motion, because control ends."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _until_ended(self, motion: Motion, held: AsyncExitStack) -> None:
        try:
            await motion.wait_event()
        finally:
            self._arm = None
            await held.aclose()
            self._task = None

    async def _follow(self) -> None:
        forget = self._robot.on_event(lambda _: self._news.set())
        try:
            async with self._turn, self._robot.control(CLIENT) as arm:
                self._arm = arm
                motion: Motion | None = None
                while self._target is not None or (motion is not None and not motion.ended):
                    self._news.clear()
                    if self._target is not None:
                        q, self._target = self._target, None
                        motion = await arm.servo_j(q, lookahead=LOOKAHEAD, shaped=True)
                    else:
                        await self._news.wait()
                self._arm = None
            if motion is not None and motion.stopped is not None:
                self._warn(f"position commands were stopped: {motion.stopped.why}")
        except TvistError as error:
            self._target = None
            self._warn(f"a position command was refused: {error}")
        finally:
            self._arm = None
            forget()

    def _followed(self, task: asyncio.Task[None]) -> None:
        """Start anew if a command came while control was given back."""
        self._task = None
        if self._target is not None and not task.cancelled():
            self.follow(self._target)
