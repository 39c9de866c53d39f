"""Forward kinematics: pose and velocity of the tool from joint angles."""

import copy
import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import bend, chain_of, start, step_along, twist
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model


@compiled_for_ticks
def turned_by(R: Floats, vector: Floats) -> None:
    """Convert a rotation matrix, shape (3, 3), to a rotation vector of at most half a turn, shape (3,) [rad].

    The way leads over the unit quaternion (w, v), computed from the largest of its entries (Shepperd, 1978), so it is
    exact for small turns and for half turns.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]  # 4 w v
    largest = max(trace, R[0, 0], R[1, 1], R[2, 2])
    if largest == trace:
        w = 1.0 + trace  # 4 w²
    elif largest == R[0, 0]:
        w, x, y, z = x, 1.0 + 2.0 * R[0, 0] - trace, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif largest == R[1, 1]:
        w, x, y, z = y, R[0, 1] + R[1, 0], 1.0 + 2.0 * R[1, 1] - trace, R[1, 2] + R[2, 1]
    else:
        w, x, y, z = z, R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + 2.0 * R[2, 2] - trace
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(size, w) / size if size > 0.0 else 0.0
    vector[0], vector[1], vector[2] = factor * x, factor * y, factor * z


@compiled_for_ticks
def tool_motion(chain: Floats, tool: Floats, q: Floats, qd: Floats, out: Floats) -> None:
    """Compute pose and velocity of a point that is fixed to the end of a chain, in the base's axes.

    Args:
        chain: The links, see `tvist_plant.chain`, shape (n+1, 22).
        tool: Rotation and position of the point in the frame of the end, the first 12 columns of a link, shape (12,).
        q: Joint positions, shape (n,) [rad].
        qd: Joint velocities, shape (n,) [rad/s].
        out: Result: position [m], rotation vector [rad], velocity [m/s] and angular velocity [rad/s], shape (12,).
    """
    R, o, S = np.empty((3, 3)), np.empty(3), np.empty(6)
    start(R, o)
    for k in range(6, 12):
        out[k] = 0.0
    for j in range(q.shape[0]):
        step_along(chain[j], R, o)
        bend(R, q[j])
        twist(R, o, S)
        for k in range(3):
            out[9 + k] += S[k] * qd[j]
            out[6 + k] += S[3 + k] * qd[j]
    step_along(chain[q.shape[0]], R, o)
    step_along(tool, R, o)
    a, b, c = out[9], out[10], out[11]
    out[6] += b * o[2] - c * o[1]
    out[7] += c * o[0] - a * o[2]
    out[8] += a * o[1] - b * o[0]
    for k in range(3):
        out[k] = o[k]
    turned_by(R, out[3:6])


class ForwardKinematics:
    """Pose and speed of the rigid arm's tool centre point, which is the flange until `set_tool` changes it.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        model = rigid_model(description, Payload())
        self.chain = chain_of(model, model.getFrameId(FLANGE))
        """The links, see `tvist_plant.chain`, shape (n+1, 22)."""
        self.set_tool((0.0,) * 6)

    def with_tool(self, offset: Sequence[float]) -> "ForwardKinematics":
        """Return the kinematics of the same arm with another tool; see `set_tool`."""
        other = copy.copy(self)
        other.set_tool(offset)
        return other

    def set_tool(self, offset: Sequence[float]) -> None:
        """Set the tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
        self.offset = np.concatenate([pin.exp3(np.array(offset[3:])).ravel(), offset[:3]])
        """Rotation and position of the tool in the flange frame, shape (12,)."""

    def tool(self, q: Floats, qd: Floats) -> tuple[list[float], list[float]]:
        """Return pose and speed in the base frame.

        Args:
            q: Joint positions, shape (n,) [rad].
            qd: Joint velocities, shape (n,) [rad/s].

        Returns:
            x y z [m] and rotation vector [rad]; linear [m/s] and angular [rad/s] velocity.
        """
        found = self.motion(q, qd).tolist()
        return found[:6], found[6:]

    def motion(self, q: Floats, qd: Floats) -> Floats:
        """Return pose and speed in one array, shape (12,); see `tool`."""
        out = np.empty(12)
        tool_motion(self.chain, self.offset, q, qd, out)
        return out


def rotation_vector(rotation: Floats) -> list[float]:
    """Convert a rotation matrix, shape (3, 3), to a rotation vector [rad]."""
    vector = np.empty(3)
    turned_by(np.ascontiguousarray(rotation), vector)
    return list(vector.tolist())
