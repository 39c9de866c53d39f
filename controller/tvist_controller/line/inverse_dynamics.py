"""Torques of a motion of the rigid arm with the declared payload."""

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import BODY
from tvist_plant.description import Payload, RobotDescription

SLEW = 250  # default duration of a payload change [ticks]


class InverseDynamics(Arm):
    """The arm with its declared payload.

    Torque is linear in a body's ten inertial parameters (mass, first moment, inertia about the joint), so a
    new payload is phased in by a ramp between two sets of them. The torque then has no step, and all sets in
    between are physically possible, since such bodies form a convex set (Wensing, Kim and Slotine, 2018).
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        super().__init__(description)
        self._before = self._present = self._after = self.bare
        self._ticks_left, self._slew = 0, SLEW
        self.payload_parameters = np.zeros_like(self.bare)
        """Present inertial parameters of the payload in the last joint's frame, in pinocchio's order, shape
        (10,); a new array after each change."""
        self.declare(payload)
        self.settle()

    def declare(self, payload: Payload, ticks: int = SLEW) -> None:
        """Declare another payload; `advance` phases it in over a number of ticks."""
        self.payload = payload
        self._before, self._after = self._present, self.loaded(payload)
        self._ticks_left = self._slew = ticks

    def advance(self) -> None:
        """Advance a payload change by one tick."""
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
        """Possible inertial parameters (10,) of the last link: two sets during a payload change, else one."""
        return (self._before, self._after) if self.changing else (self._after,)

    def believe(self, bodies: tuple[Floats, ...]) -> None:
        """Use other inertial parameters at once, in the form of `bodies`."""
        self._before, self._after = bodies[0], bodies[-1]
        self._ticks_left, self._slew = len(bodies) - 1, SLEW
        self._load(self._after)

    def settle(self) -> None:
        """Use the latest declared payload at once."""
        self._ticks_left = 0
        self._load(self._after)

    def effort(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return the largest |τ| over all `bodies`, any of which may be right, shape (n,) [N m]."""
        if self._ticks_left == 0:
            return np.abs(self.torque(q, qd, qdd))
        present, largest = self._present, np.zeros_like(q)
        for parameters in (self._before, self._after):
            self._load(parameters)
            largest = np.maximum(largest, np.abs(self.torque(q, qd, qdd)))
        self._load(present)
        return largest

    def _load(self, parameters: Floats) -> None:
        """Set the last link's inertial parameters in place, since building a model takes long."""
        self._present = parameters
        self.payload_parameters = parameters - self.bare
        self.chain[-2, BODY:] = parameters
