"""Torques that a motion of the rigid arm needs."""

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import BODY, SCRATCH, chain_of, collect_inertia, sweep, torques
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, payload_inertia, rigid_model

SLEW = 250
"""Ticks over which a new payload is phased in."""


@compiled
def torques_of(
    chain: Floats, q: Floats, qd: Floats, qdd: Floats, gravity: float, bodies: Floats, found: Floats
) -> None:
    """Torques for k states of motion, each of shape (k, n); other arguments as in `tvist_plant.chain.torques`."""
    for k in range(q.shape[0]):
        torques(chain, q[k], qd[k], qdd[k], gravity, bodies, found[k])


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
        model = rigid_model(description, Payload())
        flange = model.getFrameId(FLANGE)
        self.chain = chain_of(model, flange)
        """Parameters of the links, with the payload in use, see `tvist_plant.chain`, shape (n+1, 22)."""
        self.scratch = np.zeros((description.joints + 1, SCRATCH))
        """Scratch of `tvist_plant.chain`, shape (n+1, 28)."""
        self.gravitation = -float(model.gravity.linear[2])
        """Gravitational acceleration along the base's negative z axis [m/s^2]."""
        self._flange = model.frames[flange].placement
        self._bare = self.chain[-2, BODY:].copy()
        self._before = self._present = self._after = self._bare
        self._ticks_left, self._slew = 0, SLEW
        self.payload_parameters = np.zeros_like(self._bare)
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
        found = np.empty(len(q))
        torques(self.chain, q, qd, qdd, self.gravitation, self.scratch, found)
        return found

    def torques(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Torques for k states of motion, each argument of shape (k, n): shape (k, n) [N m]."""
        found = np.empty_like(q)
        torques_of(self.chain, q, qd, qdd, self.gravitation, self.scratch, found)
        return found

    def gravities(self, q: Floats) -> Floats:
        """g(q) at k postures, shape (k, n) [N m]."""
        still = np.zeros_like(q)
        return self.torques(q, still, still)

    def gravity(self, q: Floats) -> Floats:
        """g(q), shape (n,) [N m]."""
        still = np.zeros(len(q))
        return self.torque(q, still, still)

    def inertia(self, q: Floats) -> Floats:
        """M(q), shape (n, n) [kg m^2]."""
        still, M = np.zeros(len(q)), np.zeros((len(q), len(q)))
        sweep(self.chain, q, still, still, 0.0, self.scratch)
        collect_inertia(self.scratch, M)
        return np.asarray(M + np.triu(M, 1).T)

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
        self.payload_parameters = parameters - self._bare
        self.chain[-2, BODY:] = parameters
