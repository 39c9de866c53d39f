"""Why the joints cannot follow a path: no posture has the pose, or a singular posture is on the way."""

from collections.abc import Sequence

from tvist_controller.paths.tracking import WayError
from tvist_controller.refusal import RefusalError
from tvist_plant.description import RobotDescription


class Reachable:
    """Explains where a path cannot be followed.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._description = description

    def refusal(self, error: WayError, share: str, field: str, tcp: Sequence[float]) -> RefusalError:
        """Return the refusal of a command whose path the joints cannot follow."""
        at = " ".join(f"{value:.3f}" for value in error.pose.vector)
        return RefusalError("singular", field, f"{field}: singular at {at} {share}")
