"""Kinematics of the arm for programs, with any tool."""

from collections.abc import Callable, Sequence

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.pose import placement, placement_vector, turn
from tvist_controller.line.differentiator import Floats
from tvist_controller.motion.activity_control import MotionControl
from tvist_plant.description import RobotDescription
from tvist_urscript import Fault

SEARCH = 900  # additional evaluations of inverse kinematics that searches a curve of postures
PoseNumbers = tuple[float, float, float, float, float, float]


class ProgramKinematics:
    """Kinematics of the present or another TCP; `spend` charges the running program's budget."""

    def __init__(
        self, description: RobotDescription, motion: MotionControl, spend: Callable[[int], None]
    ) -> None:
        self._motion, self._spend = motion, spend
        self._inverse = InverseKinematics(description)
        self._flange = Arm(description)
        self._tcp: tuple[float, ...] = (0.0,) * 6
        self._tool = self._flange

    def _with(self, tcp: Sequence[float] | None) -> Arm:
        """Return the kinematics of a tool, by default the present one."""
        wanted = self._motion.tcp if tcp is None else tuple(tcp)
        if wanted != self._tcp:
            self._tcp, self._tool = wanted, self._flange.with_tool(wanted)
        return self._tool

    def tool_pose(self, q: Floats, tcp: Sequence[float] | None = None) -> PoseNumbers:
        """Return the tool pose at joint positions, x y z [m] and rotation vector [rad]."""
        return placement_vector(*self._with(tcp).pose(q))

    def jacobian(self, q: Floats, tcp: Sequence[float] | None = None) -> Floats:
        """Return the Jacobian of tool velocity [m/s] and angular velocity [rad/s], shape (6, n)."""
        return self._with(tcp).jacobian(q)

    def posture(
        self, pose: Sequence[float], near: Sequence[float], tcp: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """Return the joint positions nearest to `near` with a tool pose [rad]."""
        flange = placement(pose) @ placement(self._motion.tcp if tcp is None else tcp).inverse
        try:
            q = self._inverse.solve(flange.rotation, flange.position, np.array(near, dtype=float))
        except InverseKinematicsError as error:
            shown = ", ".join(f"{value:.4g}" for value in pose)
            raise Fault(f"no joint positions reach the pose p[{shown}]: {error}") from error
        finally:
            if self._inverse.searched:
                self._spend(SEARCH)
        return tuple(q.tolist())

    @staticmethod
    def difference(start: Sequence[float], end: Sequence[float]) -> Floats:
        """Return translation and rotation between two poses in the base frame, shape (6,) [m, rad]."""
        one, other = placement(start), placement(end)
        return np.concatenate([other.position - one.position, turn(one.rotation, other.rotation)])
