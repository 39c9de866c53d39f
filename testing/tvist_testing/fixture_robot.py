"""The robot of a test: a blocking client in lockstep whose calls advance time while they wait."""

from pathlib import Path
from typing import Generic, Self, TypeVar

from tvist_client import blocking, feed
from tvist_client import robot as asynchronous_robot
from tvist_client.connection import BUFFER
from tvist_client.errors import AnswerTimeoutError
from tvist_client.portal import Portal
from tvist_protocol.stream import Event, State
from tvist_testing.history import History
from tvist_testing.robots import RobotProcess

CLIENT = "test"  # name under which the test controls the clock while one of its calls waits
LONGEST = 15_000  # most ticks until the next message of an iterator: 30 s of simulation
M = TypeVar("M")


class SteppingRobot(asynchronous_robot.Robot):
    """An asynchronous robot that takes the clock for each call that needs time to pass."""

    async def advance(self, ticks: int) -> int:
        """Advance time by ticks of 0.002 s, at least 1; the caller needs neither control nor the clock."""
        if self.stepper is not None or self.arm is not None or await self.clock() == "realtime":
            return await super().advance(ticks)
        async with self.clock_control(CLIENT):
            return await super().advance(ticks)


class SteppingStream(blocking.Stream[M], Generic[M]):
    """Messages as an iterator that advances time until the next one."""

    def __init__(self, portal: Portal, robot: SteppingRobot, messages: feed.Stream[M]) -> None:
        super().__init__(portal, messages)
        self._robot = robot

    def __next__(self) -> M:
        for _ in range(LONGEST):
            if self._portal.call(lambda: self._inner.ready):
                return super().__next__()
            self._portal.call(lambda: self._robot.pass_time(1))
        raise AnswerTimeoutError(f"nothing came within {LONGEST} ticks of simulation")


class FixtureRobot(blocking.Robot):
    """A test's own robot; in lockstep, each call that waits for it advances its time.

    A robot with UR's interfaces is in real time, since clients of UR robots wait by the wall clock.

    Attributes:
        name: Name of the robot on the network.
        endpoint: Zenoh endpoint for programs in other processes.
        pid: Number of its process, for tests that kill or stop it.
        log: File with the robot's log.
        recording: File that the robot records into; after the test it remains only if the test failed.
        host: IP address of UR's interfaces; empty if they are closed. On Linux they have UR's usual ports.
        ports: Port of each interface: `dashboard`, `primary`, `secondary`, `realtime`, `rtde`, and so on.
        seed: Seed of sensor noise and gear errors.
        history: Measurements of the robot since the test began.
    """

    def __init__(
        self,
        portal: Portal,
        robot: SteppingRobot,
        served: RobotProcess,
        name: str,
        seed: int,
        recording: Path,
    ) -> None:
        super().__init__(portal, robot)
        self._stepping, self.name, self.seed = robot, name, seed
        self.endpoint, self.pid = served.endpoint, served.pid
        self.host, self.ports = served.host, served.ports
        self.recording, self.log = recording, recording.with_suffix(".log")
        self.history = History()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} at {self.endpoint}>"

    @classmethod
    def of(cls, served: RobotProcess, name: str, seed: int, recording: Path) -> Self:
        """Connect to a served robot, and wait for its present state."""
        portal = Portal()
        try:
            robot = portal.call(lambda: SteppingRobot.connect(served.endpoint, name))
        except BaseException:
            portal.close()
            raise
        self = cls(portal, robot, served, name, seed, recording)
        try:
            self.history.joint_limits = self.info().limits
            self.on_truth(self.history.on_truth)
            self.on_state(self.history.on_state)
            self.on_event(self.history.events.append)
            portal.call(self._inner._ios.subscribe)  # noqa: SLF001  so that `io` has a value at once
            self.info()  # answered after the robot has received the subscriptions
            served.publish_state()  # before the first tick
            portal.call(lambda: self._inner.until(0))
        except BaseException:
            self.close()
            raise
        return self

    def states(self, buffer: int = BUFFER) -> SteppingStream[State]:
        """Iterate over every state from now on; each one advances time by a tick."""
        return SteppingStream(
            self._portal, self._stepping, self._portal.call(lambda: self._inner.states(buffer))
        )

    def events(self, buffer: int = BUFFER) -> SteppingStream[Event]:
        """Iterate over every event from now on; time advances until the next one."""
        return SteppingStream(
            self._portal, self._stepping, self._portal.call(lambda: self._inner.events(buffer))
        )
