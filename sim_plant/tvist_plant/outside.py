"""External forces on an arm: torques on joints, and wrenches w on bodies, which enter the equations as Jᵀ w."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from tvist_plant.model import FLANGE, FlexibleModel, Floats


class _Wrench(NamedTuple):
    joint: int  # index of the model's joint that moves the body
    point: Floats  # point of application in the joint's frame, shape (3,) [m]
    force: Floats  # force in world axes, shape (3,) [N]
    moment: Floats  # moment about the point, world axes, shape (3,) [N m]


class Outside:
    """Torques and wrenches that act until they are changed."""

    def __init__(self, flexible: FlexibleModel) -> None:
        self._flexible = flexible
        self._data = flexible.model.createData()
        self._torque: Floats | None = None
        self._wrenches: dict[str, _Wrench] = {}
        names = list(flexible.model.names)[1:]  # without the world
        self._bodies = {name: (number, pin.SE3.Identity()) for number, name in enumerate(names, 1)}
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
            self._wrenches[body] = _Wrench(joint, placement.act(r), f, m)

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
        for wrench in self._wrenches.values():
            J = pin.getJointJacobian(self._flexible.model, self._data, wrench.joint, pin.LOCAL_WORLD_ALIGNED)
            lever = self._data.oMi[wrench.joint].rotation @ wrench.point
            sum_ += J[:3].T @ wrench.force + J[3:].T @ (wrench.moment + np.cross(lever, wrench.force))
        return sum_
