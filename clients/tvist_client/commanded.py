"""Parts of a robot that control and the clock need: commands, replies and time."""

from collections.abc import Callable
from typing import Protocol

from tvist_client.motion import MotionsByNumber
from tvist_protocol.commands import Command
from tvist_protocol.info import Clock, Info
from tvist_protocol.replies import Accepted, Done, Posture, ToolPose
from tvist_protocol.stream import Event, State

Answer = Accepted | Done | Posture | ToolPose
"""Replies to a command that was not refused."""


class CommandedRobot(Protocol):
    """A robot that takes commands; `tvist_client.robot.Robot` implements it and documents each method."""

    motions: MotionsByNumber

    @property
    def clock_token(self) -> str | None:
        """Token of the clock; None if this client does not hold it."""

    async def info(self) -> Info:
        """Request the robot's description and settings."""
        ...

    async def clock(self) -> Clock:
        """What advances simulation time."""
        ...

    async def state(self) -> State:
        """The present state."""
        ...

    async def forward_kinematics(self) -> tuple[float, float, float, float, float, float]:
        """The pose of the tool: x y z [m] and rotation vector [rad]."""
        ...

    async def request(self, command: Command, timeout_s: float = ...) -> Answer:
        """Send a command."""
        ...

    def put_setpoint(self, data: bytes) -> None:
        """Send an encoded set-point."""
        ...

    def on_event(self, callback: Callable[[Event], object]) -> Callable[[], None]:
        """Call a function with every event; the function returned ends that."""
        ...

    def watch(self) -> None:
        """Start to receive the states."""
        ...

    async def until(self, tick: int) -> State:
        """Wait until the state of a tick has arrived."""
        ...

    async def advance(self, ticks: int) -> int:
        """Advance time by a number of ticks."""
        ...

    async def pass_time(self, ticks: int) -> None:
        """Let ticks pass, or wait for them if another client steps."""
        ...

    async def rest(self) -> State:
        """Wait until the shaped reference is at rest, stepping time if this client may."""
        ...
