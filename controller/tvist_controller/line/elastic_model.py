"""What an elastic arm needs beyond its rigid model: twist of the gears and bending of the links, from a calibration."""

import numpy as np
import pinocchio as pin

from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import BODY, SCRATCH, chain_of
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, flexible_model, rigid_model


class ElasticModel:
    """The arm with springs, as far as a controller knows it; it is immutable.

    Args:
        description: The robot, of which masses, geometry and the places where links bend are used.
        stiffness: Stiffness of each gear and bending, in the order of the model's coordinates, shape (N,) [N m/rad].
        damping_time: Damping divided by stiffness, shape (N,) [s].
    """

    def __init__(self, description: RobotDescription, stiffness: Floats, damping_time: Floats) -> None:
        self._description = description
        flexible = flexible_model(description, Payload())
        self.joints, self.flexes = flexible.joints, flexible.flexes
        """Indices of the joints and of the bending among the model's coordinates."""
        self.stiffness, self.damping_time = stiffness, damping_time

    def loads(self) -> "SpringLoads":
        """Return a calculator of the loads on the springs, with a state of its own."""
        return SpringLoads(self._description)

    @property
    def size(self) -> int:
        """Number N of coordinates."""
        return len(self.stiffness)


class SpringLoads:
    """Torques on all springs that a motion of the arm needs, and the flange's Jacobian.

    Args:
        description: The robot, of which masses and geometry are used.
    """

    def __init__(self, description: RobotDescription) -> None:
        flexible = flexible_model(description, Payload())
        model, rigid = flexible.model, rigid_model(description, Payload())
        self.chain = chain_of(model, flexible.flange)
        """Parameters of the links with the payload, see `tvist_plant.chain`, shape (N+1, 22)."""
        self.scratch, self.motion = np.zeros((model.nv + 1, SCRATCH)), np.zeros((3, model.nv))
        """Scratch of the kernels in `elastic_lead`, as the next one."""
        self.jacobian = np.zeros((3, model.nv))
        self._bare = self.chain[-2, BODY:].copy()
        own = rigid.frames[rigid.getFrameId(FLANGE)]
        self._placement = model.frames[flexible.flange].placement * own.placement.inverse()
        self._added: Floats | None = None

    def carry(self, added: Floats) -> None:
        """Set the payload.

        Args:
            added: Its ten inertial parameters in the frame of the rigid arm's last joint, in pinocchio's order, shape
                (10,) [kg, kg m, kg m^2].
        """
        if added is not self._added:
            self._added = added
            self.chain[-2, BODY:] = self._bare + _moved(added, self._placement)


def _moved(parameters: Floats, placement: pin.SE3) -> Floats:
    """Express a body's ten inertial parameters in another frame; unlike with `pin.Inertia`, its mass may be zero.

    Args:
        parameters: Mass, mass times centre, and inertia about the origin (xx xy yy xz yz zz), shape (10,).
        placement: Pose of the present frame in the other one.
    """
    mass, p = parameters[0], placement.translation
    h = placement.rotation @ parameters[1:4]
    xx, xy, yy, xz, yz, zz = parameters[4:]
    turned = placement.rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ placement.rotation.T
    shift = 2.0 * (p @ h) * np.eye(3) - np.outer(p, h) - np.outer(h, p)
    inertia = turned + shift + mass * (p @ p * np.eye(3) - np.outer(p, p))
    moved = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return np.concatenate([[mass], h + mass * p, moved])
