"""External forces on an arm: torques on joints, and wrenches w on bodies, which enter the equations as Jᵀ w."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from tvist_plant.model import FLANGE, FlexibleModel, Floats


class ExternalForces:
    """Torques and wrenches that act until they are changed."""

    def __init__(self, flexible: FlexibleModel) -> None:
        self._flexible = flexible
        self._data = flexible.model.createData()
        self._torque: Floats | None = None
        self._wrenches: dict[str, tuple[int, Floats, Floats, Floats]] = {}
        """By body: the joint that moves it, point in the joint's frame [m], force [N] and moment [N m] in the world."""
        names = enumerate(list(flexible.model.names)[1:], 1)  # without the world
        self._bodies = {name: (number, pin.SE3.Identity()) for number, name in names}
        flange = flexible.model.frames[flexible.flange]
        self._bodies[FLANGE] = flange.parentJoint, flange.placement
        self.bodies = tuple(self._bodies)
        """Names of the bodies: that of the joint or virtual joint that moves each, or "flange"."""

    def clear(self) -> None:
        """End all torques and wrenches."""
        self._torque, self._wrenches = None, {}

    def push(self, torque: Floats) -> None:
        """Set the torques on the link side of the joints, as `FlexibleArm.push`."""
        given, shape = np.array(torque, dtype=float), self._flexible.joints.shape
        if given.shape != shape or not np.isfinite(given).all():
            raise ValueError(f"torque is {given.tolist()}: must be {shape[0]} finite numbers, one per joint")
        self._torque = given if given.any() else None

    def push_body(
        self, body: str, force: Sequence[float], moment: Sequence[float], point: Sequence[float]
    ) -> None:
        """Set the wrench on a body, as `FlexibleArm.push_body`."""
        if body not in self._bodies:
            raise ValueError(f"body is {body!r}: must be one of {', '.join(self._bodies)}")
        vectors = f, m, r = [np.array(value, dtype=float) for value in (force, moment, point)]
        for name, vector in zip(("force", "moment", "point"), vectors, strict=True):
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise ValueError(f"{name} is {vector.tolist()}: must be three finite numbers")
        joint, placement = self._bodies[body]
        self._wrenches.pop(body, None)
        if f.any() or m.any():
            self._wrenches[body] = joint, placement.act(r), f, m

    @property
    def rests(self) -> bool:
        """Whether there are no torques and no wrenches."""
        return self._torque is None and not self._wrenches

    def generalized_force(self, q: Floats) -> Floats:
        """Return the sum of all torques and wrenches as link torques, shape (N,) [N m]."""
        sum_ = np.zeros(self._flexible.model.nv)
        if self._torque is not None:
            sum_[self._flexible.joints] = self._torque
        if self._wrenches:
            pin.computeJointJacobians(self._flexible.model, self._data, q)
        for joint, point, force, moment in self._wrenches.values():
            J = pin.getJointJacobian(self._flexible.model, self._data, joint, pin.LOCAL_WORLD_ALIGNED)
            lever = self._data.oMi[joint].rotation @ point
            sum_ += J[:3].T @ force + J[3:].T @ (moment + np.cross(lever, force))
        return sum_
