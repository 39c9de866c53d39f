"""Moves a robot for the tabs of the page: one tab has control, and jogs stop when their messages stop."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AsyncExitStack
from typing import Any

from tvist_client.arguments import make_payload
from tvist_client.arm import Arm
from tvist_client.errors import ClientError, MisuseError, StreamStoppedError
from tvist_client.readiness import look
from tvist_client.robot import Robot
from tvist_client.unlock import make_ready
from tvist_protocol.errors import ProtocolError, RefusedError
from tvist_protocol.values import Payload

DEADMAN_S = 0.25  # time without jog messages after which the arm is stopped [s]
JOG_PERIOD = 0.02  # time between two set-points of a jog [s]
JOG_SPEED = 0.25  # jog speed as a share of the joint's velocity limit [-]
JOG_ACCELERATION = 1.5  # acceleration at the start of a jog [rad/s²]

SPEED = 1.5  # velocity of motions between poses [rad/s]

Say = Callable[[str], None]
Doing = Callable[[Arm], Awaitable[Any]]


class Pilot:
    """Control of one robot, lent to one tab at a time; all methods are called in one event loop.

    `client` is the name under which control is taken; `say` is called with a message if something was refused
    or lost.
    """

    def __init__(self, robot: Robot, client: str, say: Say) -> None:
        self._robot, self.client, self._say = robot, client, say
        self.holder: int | None = None  # number of the tab that has control; None if no tab has
        self._arm: Arm | None = None
        self._held: AsyncExitStack | None = None
        self._task: asyncio.Task[bool] | None = None
        self._jog = (0, 0.0)
        self._jog_until = self._jog_heard = 0.0
        self._jog_barred = False  # until the button is released
        self._jogging: asyncio.Task[None] | None = None
        self._changing = asyncio.Lock()

    async def take(self, tab: int) -> bool:
        """Take control for a tab; return whether it has control now."""
        async with self._changing:
            if self.holder is not None:
                if self.holder != tab:
                    self._say("another tab has control: give it back there first")
                return self.holder == tab
            stack = AsyncExitStack()
            try:
                if await self._robot.clock() != "realtime":
                    raise MisuseError("a client steps the time of this robot, so this page can only show it")
                self._arm = await stack.enter_async_context(self._robot.control(self.client))
            except (RefusedError, ClientError, ProtocolError) as error:
                self._say(str(error))
                return False
            self.holder, self._held = tab, stack
            return True

    async def give_back(self, tab: int) -> None:
        """If a tab has control, stop its motion and give control back; also called when a tab is closed."""
        async with self._changing:  # waits for control that is being taken
            if self.holder != tab:
                return
            if self.busy:
                await self.stop()
            for task in filter(None, (self._jogging, self._task)):
                task.cancel()
                await asyncio.wait([task])
            held, self._held, self._arm, self.holder = self._held, None, None, None
            with contextlib.suppress(RefusedError, ClientError):  # the robot may be gone
                if held is not None:
                    await held.aclose()

    async def heard(self, control: str | None) -> None:
        """If the robot reports that this page has lost control, take control from the tab that had it."""
        if self.holder is not None and not self._changing.locked() and control != self.client:
            self._say("this page has lost control of the robot")
            await self.give_back(self.holder)

    @property
    def busy(self) -> bool:
        """Whether a motion or a jog of a tab is running."""
        return any(task is not None and not task.done() for task in (self._task, self._jogging))

    async def stop(self) -> None:
        """Stop the arm, no matter which client moves it; this needs no control."""
        self._jog_until, self._jog_barred = 0.0, True
        if self._task is not None:
            self._task.cancel()  # a motion may have further poses
        await self._told(self._robot.stop())

    def do(self, tab: int, doing: Doing) -> None:
        """Start an action for the tab that has control, one at a time."""
        if (arm := self._lent(tab)) is None:
            return
        if self.busy:
            self._say("the arm is still moving: wait, or stop it")
        else:
            self._task = asyncio.create_task(self._told(doing(arm)))

    async def set(self, tab: int, doing: Doing) -> bool:
        """Change a setting for the tab that has control, even while the arm moves; return whether it was changed."""
        arm = self._lent(tab)
        return arm is not None and await self._told(doing(arm))

    def _lent(self, tab: int) -> Arm | None:
        """Return the arm if the tab has control; else show a message and return None."""
        if self.holder != tab:
            self._say("this tab does not have control: take it first")
            return None
        return self._arm

    def jog(self, tab: int, joint: int, direction: float) -> None:
        """Jog a joint for the next quarter of a second; call it repeatedly while the button is down."""
        # The page shows which tab has control; a message for each call would be too many.
        if self.holder != tab or self._arm is None:
            return
        now = asyncio.get_running_loop().time()
        pressed = now - self._jog_heard > DEADMAN_S or self._jog != (joint, direction)
        self._jog_heard, self._jog = now, (joint, direction)
        # The first message does not move the arm. A hidden tab sends one a second, so each counts as first.
        if pressed:
            self._jog_barred = False
            return
        if self._jog_barred or (self._task is not None and not self._task.done()):
            return
        self._jog_until = now + DEADMAN_S
        if self._jogging is None or self._jogging.done():
            self._jogging = asyncio.create_task(self._follow_jog(self._arm))

    async def make_ready(self, arm: Arm) -> None:
        """Release what a client can release, and switch the power on; show what remains to be done."""
        if (await self._robot.info()).moved is None:  # stops of a real robot are released at the robot
            await arm.inject("normal")
        await make_ready(self._robot, arm, power_on=True)
        found = await look(self._robot)
        if not found.ready:
            self._say(found.sentence)

    async def _told(self, doing: Awaitable[Any]) -> bool:
        """Wait for an action, and show why it failed; return whether it succeeded."""
        try:
            await doing
        except (RefusedError, ClientError, ProtocolError) as error:
            self._say(str(error))
            return False
        return True

    async def _follow_jog(self, arm: Arm) -> None:
        if not await self._told(self._play_jog(arm)):
            self._jog_barred = True

    async def _play_jog(self, arm: Arm) -> None:
        loop, info = asyncio.get_running_loop(), await self._robot.info()
        joint, direction = self._jog
        q = list((await self._robot.state()).target_q)
        low, high = info.limits.position[joint]
        most, speed = JOG_SPEED * info.limits.velocity[joint], 0.0
        stopped = False
        try:
            async with arm.servo(period=JOG_PERIOD) as servo:
                due = loop.time()
                while loop.time() < self._jog_until and self._jog == (joint, direction):
                    speed = min(speed + JOG_ACCELERATION * JOG_PERIOD, most)
                    q[joint] = min(max(q[joint] + direction * speed * JOG_PERIOD, low), high)
                    servo.set(q)
                    due += JOG_PERIOD
                    await asyncio.sleep(max(due - loop.time(), 0.0))
                stopped = True
                await self._robot.stop()
                while True:  # wait for the event that the stop has ended the stream
                    await asyncio.sleep(JOG_PERIOD)
                    servo.check()
        except StreamStoppedError:
            if not stopped:
                raise


async def go(arm: Arm, q: Sequence[float]) -> None:
    """Move to joint angles within the robot's velocity limits, which may be low for a real arm."""
    limits = (await arm.robot.info()).limits
    await arm.move_j(q, velocity=min(SPEED, *limits.velocity))


async def motion(arm: Arm, poses: Sequence[Sequence[float]]) -> None:
    """Move to the first pose, unless the arm is there, then to each of the others."""
    for place, q in enumerate(poses):
        at = (await arm.robot.state()).target_q
        if place or max(abs(a - b) for a, b in zip(at, q, strict=True)) > 1e-6:
            await go(arm, q)


async def carry(arm: Arm, mass: float) -> None:
    """Let a simulated arm at rest carry another mass [kg] without declaring it."""
    await arm.reset(payload=_scaled((await arm.robot.info()).payload, mass))


async def declare(arm: Arm, mass: float) -> None:
    """Declare another payload mass [kg]."""
    payload = _scaled((await arm.robot.info()).payload, mass)
    await arm.set_payload(payload.mass, payload.com, payload.inertia)


def _scaled(payload: Payload, mass: float) -> Payload:
    """Return a payload of equal shape with another mass; if its mass is 0, a steel disc of 10 cm diameter."""
    if payload.mass <= 0.0:
        across, along = 0.05**2 / 4 * mass, 0.05**2 / 2 * mass
        return make_payload(mass, (0.0, 0.0, 0.03), (across, 0.0, 0.0, across, 0.0, along))
    share = mass / payload.mass
    return make_payload(mass, payload.com, [share * entry for entry in payload.inertia])
