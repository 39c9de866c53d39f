"""What a motion leaves of vibration, as a linear function of its accelerations, from a model of the flexible arm.

The coordinates ξ are the L joints and bends of the links, followed by the n motors. They are deviations from a rigid
arm on the reference q̄(t), which ends in equilibrium:

    I(q̄) ξ̈ + C ξ̇ + K ξ = (-f, f_j + K_d (K_p w + ẇ)),     f = rnea(q̄, q̄̇, q̄̈) - g(q̄(T)),     w = c_w f_j/K_g,

where f_j are the joints' entries of f, which the drives are fed forward, with a share c_w of the gears' wind-up.
Inertia and load are those on the way, so centrifugal torque and the change of gravity count, too. The load is linear
in the acceleration. So is the state at the end, weighted by what it will do to the tool: a row for each of the few
directions that matter, and an offset. Both are computed backwards from the end.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tvist_controller.calibrations.modal import drivetrain
from tvist_controller.trajectory.limits import Floats
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import flexible_model
from tvist_protocol.calibration import Calibration
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError

LATE = 0.010
"""Time after the end from which the tool's acceleration counts [s]."""
HELD = 0.008
"""Time for which the inertia is taken as constant [s]."""
FINE, DOUBLINGS = 5e-4, 12
"""Step of the integral of the tool's acceleration [s], and how often the time that it covers is doubled."""
WEAKEST = 1e-10
"""Smallest share of the vibration's energy of a direction that counts [-]."""
TERMS = 10
"""Number of terms of the exponential's series."""


@dataclass(frozen=True)
class Remains:
    """What a motion leaves: r = rows a + offset, for the accelerations a of its way at its last k + 1 steps.

    |r|² is the integral of the tool's squared acceleration after the motion [m²/s³].
    """

    rows: Floats
    """Shape (r, k + 1), the end last."""
    offset: Floats
    """Shape (r,)."""


class ElasticArm:
    """Linear model of a flexible arm with a payload.

    Args:
        description: The robot: its masses and geometry, and the feed-forward of its drives.
        calibration: Springs and drives, with a modal model.
        payload: Payload that the arm is assumed to carry.

    Raises:
        EstimatorError: The calibration has no modal model, or belongs to another arm.
    """

    def __init__(self, description: RobotDescription, calibration: Calibration, payload: Payload) -> None:
        if calibration.modal is None:
            raise EstimatorError("modal", None, "a calibration with a modal model")
        body = Body(mass=payload.mass, com=payload.com, inertia=payload.inertia)
        self._flexible = flexible = flexible_model(description, body)
        self._data = flexible.model.createData()
        self._train = drivetrain(calibration.modal.parameters, description, flexible)
        joints, L = flexible.joints, flexible.model.nv
        K, _, K_d, K_p, _ = self._train.rows[:, joints]
        windup = np.array(description.drives.windup_feedforward) / K
        motors = L + np.arange(len(joints))
        self._force, self._rise = np.zeros((2, L + len(joints), L))
        self._force[:L] = -np.eye(L)
        self._force[motors, joints] = 1.0 + K_d * K_p * windup
        self._rise[motors, joints] = K_d * windup

    def remains(self, q: Floats, slope: Floats, speed: Floats, step: float) -> Remains:
        """Linearise about the last part of a motion along a straight line in joint space.

        Args:
            q: Postures at its last k + 1 steps, the end last, shape (k + 1, n) [rad].
            slope: Change of the posture per unit of the way, shape (n,) [rad].
            speed: Velocity on the way at these steps, shape (k + 1,) [1/s].
            step: Time between steps [s].
        """
        last = len(q) - 1
        loads = [self._load(posture, slope, v) for posture, v in zip(q, speed.tolist(), strict=True)]
        still = loads[last][1]
        P = self._watched(q[last])
        rows, offset = np.zeros((len(P), last + 1)), np.zeros(len(P))
        moved = first = second = np.zeros(0)
        held = max(round(HELD / step), 1)
        for i in range(last - 1, -1, -1):
            if (last - 1 - i) % held == 0:
                moved, first, second = self._step(q[i], step)
            ends = P @ (first - second / step), P @ (second / step)
            for knot, weights in zip((i, i + 1), ends, strict=True):
                gain, rest = loads[knot]
                rows[:, knot] += weights @ gain
                offset += weights @ (rest - still)
            P = P @ moved
        return Remains(rows, offset)

    def _load(self, q: Floats, slope: Floats, speed: float) -> tuple[Floats, Floats]:
        """Load per acceleration of the way, and the load at no acceleration; each of shape (L,) [N m]."""
        model, data = self._flexible.model, self._data
        posture, along, still = self._spread(q), self._spread(slope), np.zeros(model.nv)
        rest = np.array(pin.rnea(model, data, posture, speed * along, still))
        gain = pin.rnea(model, data, posture, speed * along, along) - rest
        return gain, rest

    def _spread(self, values: Floats) -> Floats:
        """Values of the joints among those of all links, which do not bend."""
        spread = np.zeros(self._flexible.model.nv)
        spread[self._flexible.joints] = values
        return spread

    def _system(self, q: Floats) -> tuple[Floats, Floats]:
        """First-order system (ξ, ξ̇) at a posture, shape (2 N, 2 N); and the inverse inertia, shape (N, N)."""
        mass = pin.crba(self._flexible.model, self._data, self._spread(q), pin.Convention.WORLD)
        inertia, damping, stiffness = self._train.system(np.asarray(mass))
        N, lightness = len(inertia), np.linalg.inv(inertia)
        A = np.zeros((2 * N, 2 * N))
        A[:N, N:] = np.eye(N)
        A[N:, :N], A[N:, N:] = -lightness @ stiffness, -lightness @ damping
        return A, np.asarray(lightness, dtype=float)

    def _step(self, q: Floats, step: float) -> tuple[Floats, Floats, Floats]:
        """One step for a load f + f' t: the state's transition, and the effects of f and of f'."""
        A, lightness = self._system(q)
        size, N, L = len(A), len(lightness), self._force.shape[1]
        whole = np.zeros((size + 2 * L, size + 2 * L))
        whole[:size, :size] = A
        whole[N:size, size : size + L] = lightness @ self._force
        whole[N:size, size + L :] = lightness @ self._rise
        whole[size : size + L, size + L :] = np.eye(L)
        found = exponential(whole * step)[:size]
        return found[:, :size], found[:, size : size + L], found[:, size + L :]

    def _watched(self, q: Floats) -> Floats:
        """Root of the integral of the tool's squared acceleration over all later time, for a state at rest at q."""
        model, data, flexible = self._flexible.model, self._data, self._flexible
        A, _ = self._system(q)
        L, N = model.nv, len(A) // 2
        world = pin.LOCAL_WORLD_ALIGNED
        J = pin.computeFrameJacobian(model, data, self._spread(q), flexible.flange, world)[:3]
        seen = J @ A[N : N + L]
        moved = exponential(A * FINE)
        late = np.linalg.matrix_power(moved, round(LATE / FINE))
        energy = FINE * seen.T @ seen
        for _ in range(DOUBLINGS):
            energy = energy + moved.T @ energy @ moved
            moved = moved @ moved
        energy = late.T @ energy @ late
        values, vectors = np.linalg.eigh(0.5 * (energy + energy.T))
        kept = values > WEAKEST * values.max()
        root: Floats = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
        return root


def exponential(A: Floats) -> Floats:
    """Exponential of a matrix, by its series after halving and by squaring (Moler and Van Loan 2003, method 3)."""
    halvings = max(int(np.ceil(np.log2(max(float(np.abs(A).sum(axis=0).max()), 1e-9) / 0.25))), 0)
    part, one = A / 2.0**halvings, np.eye(len(A))
    found = one + part / TERMS
    for k in range(TERMS - 1, 0, -1):
        found = one + part @ found / k
    for _ in range(halvings):
        found = found @ found
    return found
