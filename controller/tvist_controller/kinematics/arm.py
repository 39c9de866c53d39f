"""The rigid arm as a chain of links: pose and motion of its tool, and torques of a motion.

The end of the chain is the tool centre point. All results are in the base frame, as pinocchio's
LOCAL_WORLD_ALIGNED. Kernels take the links as `tvist_plant.chain` describes them, shape (n+1, 22).
"""

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np
import pinocchio as pin

from tvist_controller._compiled import compiled, compiled_for_ticks
from tvist_controller.kinematics.pose import locate, newton, pseudo_inverse, turned_by
from tvist_plant.chain import BODY, SCRATCH, SHIFT, TURN, chain_of, collect_inertia, sweep, torques
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, Floats, payload_inertia, rigid_model
from tvist_plant.plant import GRAVITY

AT_FLANGE = (0.0,) * 6  # tool centre point of an arm without tool


@compiled_for_ticks
def end_motion(chain: Floats, q: Floats, qd: Floats, out: Floats) -> None:
    """Compute position [m], rotation vector [rad] and their velocities at the end, shape (12,)."""
    R, J = np.empty((3, 3)), np.empty((6, q.shape[0]))
    locate(chain, q, R, out[:3], J)
    turned_by(R, out[3:6])
    for k in range(6):
        out[6 + k] = 0.0
        for j in range(q.shape[0]):
            out[6 + k] += J[k, j] * qd[j]


@compiled_for_ticks
def end_acceleration(chain: Floats, q: Floats, qd: Floats, qdd: Floats, out: Floats) -> None:
    """Compute the end's linear and angular acceleration, J q̈ + J̇ q̇, shape (6,) [m/s^2, rad/s^2].

    Columns of the Jacobian have parts v and ω. At unit velocity, joint k changes v_j at the rate ω_min(j,k) x
    v_max(j,k) and, if k < j, ω_j at the rate ω_k x ω_j.
    """
    R, o, J = np.empty((3, 3)), np.empty(3), np.empty((6, q.shape[0]))
    locate(chain, q, R, o, J)
    a = b = c = 0.0  # angular velocity of the links before
    for k in range(6):
        out[k] = 0.0
    for j in range(qd.shape[0]):
        u, v, w = J[0, j], J[1, j], J[2, j]
        x, y, z, rate = J[3, j], J[4, j], J[5, j], qd[j]
        out[3] += rate * (b * z - c * y)
        out[4] += rate * (c * x - a * z)
        out[5] += rate * (a * y - b * x)
        d, e, f = 2.0 * a + x * rate, 2.0 * b + y * rate, 2.0 * c + z * rate
        out[0] += rate * (e * w - f * v)
        out[1] += rate * (f * u - d * w)
        out[2] += rate * (d * v - e * u)
        a, b, c = a + x * rate, b + y * rate, c + z * rate
    for k in range(6):
        for j in range(q.shape[0]):
            out[k] += J[k, j] * qdd[j]


@compiled
def torques_of(chain: Floats, q: Floats, qd: Floats, qdd: Floats, bodies: Floats, found: Floats) -> None:
    """Compute torques for k states of motion, each of shape (k, n); see `tvist_plant.chain.torques`."""
    for k in range(q.shape[0]):
        torques(chain, q[k], qd[k], qdd[k], GRAVITY, bodies, found[k])


class Arm:
    """Kinematics and dynamics of the rigid arm, with a TCP in the flange frame: x y z [m], turn [rad]."""

    def __init__(self, description: RobotDescription, tcp: Sequence[float] = AT_FLANGE) -> None:
        model = rigid_model(description, Payload())
        flange = model.getFrameId(FLANGE)
        self._flange = model.frames[flange].placement
        self.chain = chain_of(model, flange)  # the links, including the load of the last one, shape (n+1, 22)
        self.scratch = np.zeros((description.joints + 1, SCRATCH))
        """Scratch of `tvist_plant.chain`, shape (n+1, 28)."""
        self.bare = self.chain[-2, BODY:].copy()
        """Inertial parameters of the last link without a payload, in pinocchio's order, shape (10,)."""
        self._attach(tcp)

    def _attach(self, tcp: Sequence[float]) -> None:
        tool = pin.SE3(np.asarray(pin.exp3(np.array(tcp[3:], dtype=float))), np.array(tcp[:3], dtype=float))
        end = self._flange * tool if any(tcp) else self._flange
        self.chain[-1, TURN:SHIFT], self.chain[-1, SHIFT:BODY] = end.rotation.ravel(), end.translation

    def with_tool(self, tcp: Sequence[float]) -> Self:
        """Return a copy of the arm with another tool centre point."""
        other = copy.copy(self)
        other.chain, other.scratch = self.chain.copy(), self.scratch.copy()
        other._attach(tcp)  # noqa: SLF001  one of its own kind
        return other

    def loaded(self, payload: Payload) -> Floats:
        """Return the inertial parameters of the last link with a payload on the flange, shape (10,)."""
        return self.bare if payload.mass == 0.0 else self.bare + self.on_flange(payload)

    def on_flange(self, payload: Payload) -> Floats:
        """Return the inertial parameters of a payload on the flange in the last link's frame, shape (10,)."""
        return np.asarray(self._flange.act(payload_inertia(payload)).toDynamicParameters())

    def pose(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the rotation matrix, shape (3, 3), and the position, shape (3,) [m], of the tool."""
        return self.located(q)[:2]

    def jacobian(self, q: Floats) -> Floats:
        """Return the Jacobian: velocity [m/s], then angular velocity [rad/s], shape (6, n)."""
        return self.located(q)[2]

    def located(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotation matrix, position and Jacobian of the tool."""
        rotation, position, jacobian = np.empty((3, 3)), np.empty(3), np.empty((6, len(q)))
        locate(self.chain, q, rotation, position, jacobian)
        return rotation, position, jacobian

    def motion(self, q: Floats, qd: Floats) -> Floats:
        """Return pose and velocity of the tool, see `end_motion`, shape (12,)."""
        out = np.empty(12)
        end_motion(self.chain, q, qd, out)
        return out

    def acceleration(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return linear and angular acceleration of the tool, shape (6,) [m/s^2, rad/s^2]."""
        out = np.empty(6)
        end_acceleration(self.chain, q, qd, qdd, out)
        return out

    def inverse(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the Jacobian and pseudo-inverse (n, 6), zero in directions lost at a singular posture."""
        jacobian, inverse = self.jacobian(q), np.empty((len(q), 6))
        pseudo_inverse(jacobian, inverse)
        return jacobian, inverse

    def near(
        self, goal: tuple[Floats, Floats], q: Floats, inverse: Floats | None = None, steps: int = 12
    ) -> tuple[Floats, Floats]:
        """Return joint positions near q for a tool pose, and remaining error; for `inverse` see `newton`."""
        rotation, position = map(
            np.ascontiguousarray, goal
        )  # same memory layout, so that the kernel is compiled only once
        found, error = q.copy(), np.empty(6)
        nearby = self.inverse(q)[1] if inverse is None else inverse
        newton(self.chain, rotation, position, nearby, steps, found, error)
        return found, error

    def torque(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return τ = M(q) q̈ + C(q, q̇) q̇ + g(q), shape (n,) [N m]."""
        found = np.empty(len(q))
        torques(self.chain, q, qd, qdd, GRAVITY, self.scratch, found)
        return found

    def torques(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return torques for k states of motion, arguments and result of shape (k, n) [N m]."""
        found = np.empty_like(q)
        torques_of(self.chain, q, qd, qdd, self.scratch, found)
        return found

    def gravities(self, q: Floats) -> Floats:
        """Return g(q) at k postures, shape (k, n) [N m]."""
        still = np.zeros_like(q)
        return self.torques(q, still, still)

    def gravity(self, q: Floats) -> Floats:
        """Return g(q), shape (n,) [N m]."""
        still = np.zeros(len(q))
        return self.torque(q, still, still)

    def inertia(self, q: Floats) -> Floats:
        """Return M(q), shape (n, n) [kg m^2]."""
        still, M = np.zeros(len(q)), np.zeros((len(q), len(q)))
        sweep(self.chain, q, still, still, 0.0, self.scratch)
        collect_inertia(self.scratch, M)
        return np.asarray(M + np.triu(M, 1).T)


SLEW = 250  # default duration of a payload change [ticks]


class InverseDynamics(Arm):
    """The arm with its declared payload.

    Torque is linear in a body's ten inertial parameters (mass, first moment, inertia about the joint), so a
    new payload is phased in by a ramp between two sets of parameters. The torque then has no step, and all
    sets in between are physically possible, since possible parameters form a convex set (Wensing, Kim and
    Slotine, 2018).
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
        """True while the torque changes from the previous payload to the new one."""
        return self._ticks_left > 0

    @property
    def bodies(self) -> tuple[Floats, ...]:
        """Inertial parameters (10,) of the last link: both sets in a payload change, else the present one."""
        return (self._before, self._after) if self.changing else (self._after,)

    def use_bodies(self, bodies: tuple[Floats, ...]) -> None:
        """Use other inertial parameters at once, in the form of `bodies`."""
        self._before, self._after = bodies[0], bodies[-1]
        self._ticks_left, self._slew = len(bodies) - 1, SLEW
        self._load(self._after)

    def settle(self) -> None:
        """Use the latest declared payload at once."""
        self._ticks_left = 0
        self._load(self._after)

    def effort(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return the largest |τ| over all `bodies`, since any may be the true one, shape (n,) [N m]."""
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
