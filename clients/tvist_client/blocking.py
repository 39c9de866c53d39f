"""The client without `await`: the same names, and an event loop in a separate thread.

    with Robot.connect() as robot, robot.control("me") as arm:
        arm.move_j(q)

A call waits for its answer; Ctrl-C ends the wait. Callbacks run in the loop's thread and must not block.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Generic, Self, TypeVar

from tvist_client import robot as asynchronous_robot
from tvist_client import stream as asynchronous_stream
from tvist_client.blocking_arm import Arm, Servo, Stepper
from tvist_client.blocking_motion import Motion
from tvist_client.commanded import Answer
from tvist_client.portal import Portal
from tvist_client.published import BUFFER
from tvist_client.robot import ANSWER_S, ENDPOINT, NAME
from tvist_client.transports.base import Transport
from tvist_client.transports.certificates import Folder
from tvist_protocol.commands import Command
from tvist_protocol.info import Clock, Info
from tvist_protocol.io import Io
from tvist_protocol.stream import Event, State, Telemetry, Truth

__all__ = ["Arm", "Motion", "Robot", "Servo", "Stepper", "Stream"]

M = TypeVar("M")


class Stream(Iterator[M], Generic[M]):
    """Messages as an iterator; see `tvist_client.stream.Stream`."""

    def __init__(self, portal: Portal, stream: asynchronous_stream.Stream[M]) -> None:
        self._portal = portal
        self._stream = stream

    @property
    def dropped(self) -> int:
        """Number of messages that were dropped because the reader was too slow."""
        return self._stream.dropped

    def __next__(self) -> M:
        try:
            return self._portal.call(self._stream.__anext__)
        except StopAsyncIteration:
            raise StopIteration from None


class Robot:
    """One robot; see `tvist_client.robot.Robot` for the arguments."""

    def __init__(self, portal: Portal, robot: asynchronous_robot.Robot) -> None:
        self._portal = portal
        self._robot = robot

    @classmethod
    def connect(
        cls,
        endpoint: str = ENDPOINT,
        name: str = NAME,
        *,
        security: Folder | None = None,
        namespace: str = "",
    ) -> Self:
        """Connect over Zenoh and check that the robot answers."""
        portal = Portal()
        try:
            robot = portal.call(
                lambda: asynchronous_robot.Robot.connect(
                    endpoint, name, security=security, namespace=namespace
                )
            )
        except BaseException:
            portal.close()
            raise
        return cls(portal, robot)

    @classmethod
    def over(cls, transport: Transport) -> Self:
        """Use a robot over a transport that is not yet bound to an event loop, such as the loopback's."""
        portal = Portal()
        return cls(portal, portal.run(lambda: asynchronous_robot.Robot.over(transport)))

    def close(self) -> None:
        """Close the connection and end the loop's thread; a second call does nothing."""
        if not self._portal.closed:
            try:
                self._portal.call(self._robot.close)
            finally:
                self._portal.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def info(self) -> Info:
        """Request the robot's description and settings."""
        return self._portal.call(self._robot.info)

    def clock(self) -> Clock:
        """What advances simulation time."""
        return self._portal.call(self._robot.clock)

    def state(self) -> State:
        """Return the present state: in real time the next one to arrive, otherwise the last one."""
        return self._portal.call(self._robot.state)

    def states(self, buffer: int = BUFFER) -> Stream[State]:
        """Iterate over every state from now on."""
        return Stream(self._portal, self._portal.run(lambda: self._robot.states(buffer)))

    def events(self, buffer: int = BUFFER) -> Stream[Event]:
        """Iterate over every event from now on."""
        return Stream(self._portal, self._portal.run(lambda: self._robot.events(buffer)))

    def on_state(self, callback: Callable[[State], object]) -> Callable[[], None]:
        """Call a function with every state; the function returned ends that."""
        return self._portal.subscription(lambda: self._robot.on_state(callback))

    def on_event(self, callback: Callable[[Event], object]) -> Callable[[], None]:
        """Call a function with every event; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_event(callback))

    def on_truth(self, callback: Callable[[Truth], object]) -> Callable[[], None]:
        """Call a function with every truth message; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_truth(callback))

    def on_telemetry(self, callback: Callable[[Telemetry], object]) -> Callable[[], None]:
        """Call a function with every telemetry message; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_telemetry(callback))

    def on_io(self, callback: Callable[[Io], object]) -> Callable[[], None]:
        """Call a function with every message about inputs, outputs, registers and tool; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_io(callback))

    def io(self) -> Io:
        """Return inputs, outputs, registers and tool."""
        return self._portal.call(self._robot.io)

    def request(self, command: Command, timeout_s: float = ANSWER_S) -> Answer:
        """Send any command."""
        return self._portal.call(lambda: self._robot.request(command, timeout_s))

    def inverse_kinematics(
        self,
        pose: Iterable[float],
        *,
        near: Iterable[float] | None = None,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, ...]:
        """Return joint positions at which the tool has a pose, the nearest of all."""
        return self._portal.call(
            lambda: self._robot.inverse_kinematics(pose, near=near, tcp_offset=tcp_offset, frame=frame)
        )

    def forward_kinematics(
        self,
        q: Iterable[float] | None = None,
        *,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, float, float, float, float, float]:
        """Return the pose that the tool has at joint positions."""
        return self._portal.call(
            lambda: self._robot.forward_kinematics(q, tcp_offset=tcp_offset, frame=frame)
        )

    def stop(self) -> None:
        """Bring the arm to rest now; no control is needed."""
        self._portal.call(self._robot.stop)

    @contextlib.contextmanager
    def control(self, client: str, *, lease_s: float = 30.0) -> Iterator[Arm]:
        """Hold control for as long as the block lasts."""
        with self._portal.enter(self._robot.control(client, lease_s=lease_s)) as arm:
            yield Arm(self._portal, arm)

    @contextlib.contextmanager
    def clock_control(self, client: str) -> Iterator[Stepper]:
        """Hold the clock for as long as the block lasts, in lockstep and free."""
        with self._portal.enter(self._robot.clock_control(client)) as stepper:
            yield Stepper(self._portal, stepper)

    def advance(self, ticks: int) -> int:
        """Advance time: by steps in lockstep and free, by waiting in real time."""
        return self._portal.call(lambda: self._robot.advance(ticks))

    def rest(self) -> State:
        """Advance time until the shaped reference is at rest."""
        return self._portal.call(self._robot.rest)
