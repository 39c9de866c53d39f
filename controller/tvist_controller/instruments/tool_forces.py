"""Forces and torques on the arm in the last tick, computed when somebody asks."""

from collections.abc import Callable

from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.instruments.wrench import ToolWrench, since_zeroed
from tvist_plant.description import RobotDescription
from tvist_protocol.stream import State


class ToolForces:
    """What the drives' torques say of the outside.

    Args:
        description: The robot.
        peripherals: The tool centre point, and the wrench that counts as zero.
        latest: Returns the state of the last tick.
    """

    def __init__(
        self, description: RobotDescription, peripherals: Peripherals, latest: Callable[[], State]
    ) -> None:
        self._wrench, self._peripherals, self._latest = ToolWrench(description), peripherals, latest

    def torques(self) -> list[float]:
        """External torques on the joints, shape (n,) [N m]."""
        return self._estimate()[6:]

    def wrench(self) -> list[float]:
        """External force and torque at the tool centre point, base frame [N, N m]."""
        return since_zeroed(self._estimate()[:6], self._peripherals.wrench_zero)

    def zero(self) -> None:
        """Take the present force and torque at the tool as zero."""
        self._peripherals.zero_wrench(self._estimate()[:6])

    def _estimate(self) -> list[float]:
        found: list[float] = self._wrench.of(self._latest(), self._peripherals.tcp_offset).tolist()
        return found
