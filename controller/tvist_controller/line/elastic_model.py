"""What an elastic arm needs beyond its rigid model: twist of the gears and bending of the links, from a calibration."""

import numpy as np
import pinocchio as pin

from tvist_controller.line.differentiator import Floats, Target
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

    def deflections(self, load: Floats) -> Floats:
        """Deflections under a constant load, shape (N,) [rad]: gears twist with it, and links bend against it."""
        found: Floats = load / self.stiffness
        found[self.flexes] *= -1.0
        return found

    @property
    def size(self) -> int:
        """Number N of coordinates."""
        return len(self.stiffness)


class SpringLoads:
    """Torques on all springs that a motion of the unbent arm needs, and the flange's Jacobian.

    Args:
        description: The robot, of which masses and geometry are used.
    """

    def __init__(self, description: RobotDescription) -> None:
        flexible = flexible_model(description, Payload())
        self._model, self._flange = flexible.model, flexible.flange
        self._model.gravity = pin.Motion.Zero()  # gravity's share is static: it makes the arm sag, not swing
        self._data = self._model.createData()
        self._joints = flexible.joints
        frame = self._model.frames[self._flange]
        self._last = frame.parentJoint
        self._bare = self._model.inertias[self._last].toDynamicParameters()
        rigid = rigid_model(description, Payload())
        own = rigid.frames[rigid.getFrameId(FLANGE)]
        self._placement = frame.placement * own.placement.inverse()
        self._added: Floats | None = None
        self._q, self._qd, self._qdd = np.zeros((3, self._model.nv))

    def carry(self, added: Floats) -> None:
        """Set the payload.

        Args:
            added: Its ten inertial parameters in the frame of the rigid arm's last joint, in pinocchio's order, shape
                (10,) [kg, kg m, kg m^2].
        """
        if added is not self._added:
            self._added = added
            parameters = self._bare + _moved(added, self._placement)
            self._model.inertias[self._last] = pin.Inertia.FromDynamicParameters(parameters)

    def of(self, target: Target) -> tuple[Floats, Floats]:
        """Compute the loads for links that are not bent.

        Returns:
            Torques on the springs without gravity, shape (N,) [N m], and the flange's Jacobian in the base's axes,
            shape (6, N).
        """
        joints, q = self._joints, self._q
        q[joints], self._qd[joints], self._qdd[joints] = target.q, target.qd, target.qdd
        load = pin.rnea(self._model, self._data, q, self._qd, self._qdd)
        jacobian = pin.computeFrameJacobian(self._model, self._data, q, self._flange, pin.LOCAL_WORLD_ALIGNED)
        return load, jacobian.reshape(6, -1)  # that of a single coordinate has one dimension


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
