"""The client without `await`: the same names, and an event loop in a separate thread.

    with Robot.connect() as robot, robot.control("me") as arm:
        arm.move_j(q)

A call waits for its answer; Ctrl-C ends the wait. Callbacks run in the loop's thread and must not block.
"""

from types import TracebackType
from typing import Self

from tvist_client import blocking_classes
from tvist_client import robot as asynchronous_robot
from tvist_client.blocking_classes import Arm, Motion, Servo, Stepper
from tvist_client.blocking_stream import Stream
from tvist_client.portal import Portal
from tvist_client.robot import ENDPOINT, NAME
from tvist_client.transports.base import Transport
from tvist_client.transports.certificates import Folder

__all__ = ["Arm", "Motion", "Robot", "Servo", "Stepper", "Stream"]


class Robot(blocking_classes.Robot):
    """One robot; see `tvist_client.robot.Robot` for the arguments of `connect`."""

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
