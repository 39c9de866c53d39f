"""Torques that a motion of the rigid arm needs."""

import numpy as np
import pinocchio as pin

from tvist_controller.control.differentiator import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, payload_inertia, rigid_model

SLEW = 250
"""Ticks over which a new payload is phased in."""


class InverseDynamics:
    """Recursive Newton-Euler algorithm on the rigid model with the declared payload.

    Torque is linear in the ten inertial parameters of a body (mass, mass times centre of mass, inertia about the
    joint), so a new payload is phased in by a ramp between two sets of them. The torque then has no step, and every
    set in between is a physically possible body (Wensing, Kim and Slotine, 2018: such bodies are a convex set).

    Args:
        description: The robot.
        payload: Declared payload.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._model = rigid_model(description, Payload())
        self._data = self._model.createData()
        flange = self._model.frames[self._model.getFrameId(FLANGE)]
        self._last, self._flange = flange.parentJoint, flange.placement
        self._bare = self._model.inertias[self._last].toDynamicParameters()
        self._before = self._present = self._after = self._bare
        self._ticks_left, self._slew = 0, SLEW
        self.carried = np.zeros_like(self._bare)
        """Inertial parameters of the payload in use in the frame of the last joint, in pinocchio's order, shape (10,).

        It is a new array whenever they change.
        """
        self.declare(payload)
        self.settle()

    def declare(self, payload: Payload, ticks: int = SLEW) -> None:
        """Declare another payload, which `advance` phases in.

        Args:
            payload: Declared payload.
            ticks: Ticks over which it is phased in.
        """
        self.payload = payload
        self._before, self._after = self._present, self._bare
        if payload.mass > 0.0:
            placed = self._flange.act(payload_inertia(payload))
            self._after = self._bare + placed.toDynamicParameters()
        self._ticks_left = self._slew = ticks

    def advance(self) -> None:
        """Advance the change to the latest declared payload by one tick."""
        if self._ticks_left == 0:
            return
        self._ticks_left -= 1
        left = self._ticks_left / self._slew
        share = (1.0 - left) ** 2 * (1.0 + 2.0 * left)
        self._load(self._before + share * (self._after - self._before) if left > 0.0 else self._after)

    @property
    def changing(self) -> bool:
        """Whether a new payload is being phased in."""
        return self._ticks_left > 0

    @property
    def bodies(self) -> tuple[Floats, ...]:
        """Possible inertial parameters of the last link: two sets while a new payload is being phased in, else one.

        Each has shape (10,), in pinocchio's order [kg, kg m, kg m^2].
        """
        return (self._before, self._after) if self.changing else (self._after,)

    def believe(self, bodies: tuple[Floats, ...]) -> None:
        """Use other inertial parameters at once, as `bodies` returns them."""
        self._before, self._after = bodies[0], bodies[-1]
        self._ticks_left, self._slew = len(bodies) - 1, SLEW
        self._load(self._after)

    def settle(self) -> None:
        """Use the latest declared payload at once."""
        self._ticks_left = 0
        self._load(self._after)

    def torque(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """τ = M(q) q̈ + C(q, q̇) q̇ + g(q), shape (n,) [N m]."""
        return np.array(pin.rnea(self._model, self._data, q, qd, qdd))

    def torques(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Torques for k states of motion, each argument of shape (k, n): shape (k, n) [N m]."""
        found = np.empty_like(q)
        for number in range(len(q)):
            found[number] = pin.rnea(self._model, self._data, q[number], qd[number], qdd[number])
        return found

    def gravities(self, q: Floats) -> Floats:
        """g(q) at k postures, shape (k, n) [N m]."""
        found = np.empty_like(q)
        for number in range(len(q)):
            found[number] = pin.computeGeneralizedGravity(self._model, self._data, q[number])
        return found

    def gravity(self, q: Floats) -> Floats:
        """g(q), shape (n,) [N m]."""
        return np.array(pin.computeGeneralizedGravity(self._model, self._data, q))

    def inertia(self, q: Floats) -> Floats:
        """M(q), shape (n, n) [kg m^2]."""
        return np.array(pin.crba(self._model, self._data, q, pin.Convention.WORLD))

    def effort(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Largest |τ| over all of `bodies`, shape (n,) [N m]: while a payload is phased in, either one may be right."""
        if self._ticks_left == 0:
            return np.abs(self.torque(q, qd, qdd))
        present, largest = self._present, np.zeros_like(q)
        for parameters in (self._before, self._after):
            self._load(parameters)
            largest = np.maximum(largest, np.abs(self.torque(q, qd, qdd)))
        self._load(present)
        return largest

    def _load(self, parameters: Floats) -> None:
        """Set the inertial parameters of the last link with its payload in place, since building a model takes long."""
        self._present = parameters
        self.carried = parameters - self._bare
        self._model.inertias[self._last] = pin.Inertia.FromDynamicParameters(parameters)
