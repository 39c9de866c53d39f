"""Estimation of the carried payload from motor torques and angles of a motion.

For means over 20 ms, the torques of an arm with mass m and its centre at c + d are

    τ = Y_l(q, q̇, q̈) 1 + B q̈ + F(q̇) + Y_m m + Y_c m d

Y_l has a column per link, Y_m is that of a kilogram at c, by inverse dynamics at the *measured* angles, so
that springs and drive gains are not needed. All other uncertain quantities are estimated with m and m d, with
the prior deviations `UNKNOWN`: they reduce certainty instead of appearing as a mass.
"""

from dataclasses import dataclass

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.differentiator import Floats
from tvist_controller.safety.experience import Experience, Later, MotionRecord, Plans, at_once
from tvist_controller.setup import Setup
from tvist_plant.chain import BODY
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.values import Payload

BLOCK = 10  # ticks averaged per block
MIN_BLOCKS = 20  # smallest number of blocks of a motion
UNKNOWN = {
    "friction": 0.2,
    "friction's width": 1.0,
    "viscous friction": 0.3,
    "sensor": 0.03,
    "standing": 0.3,
    "link": 0.03,
    "rotor": 0.2,
}
"""Prior deviations per joint [-]: Coulomb friction, relative; effect of half its width; viscous friction at 1 rad/s
relative to Coulomb friction; gain of the torque sensor; friction at rest; mass of the link; rotor inertia."""
FRICTION = ("friction", "friction's width", "viscous friction", "standing")  # which of these are friction
NOISE = (0.08, 0.001)  # noise of a mean: fraction of Coulomb friction plus fraction of the torque limit [-]
STICKING = 0.3  # fraction of Coulomb friction that is noise at speeds too low for a certain sign [-]
CENTRE = 0.05  # deviation of an unknown payload's centre from the robot file's, per axis [m]
FARTHEST = 0.3  # largest plausible distance of a centre of mass from the flange, per axis [m]
DECLARED = (0.1, 0.01)  # deviation of a declared payload: mass [kg] and centre [m]
DRIFT = (0.2, 0.01)  # deviation due to changes since the last motion: mass [kg] and centre [m]
LIGHT = 0.25  # mass below which the centre of mass is not estimated [kg]
DEAD = 0.25  # smallest change of mass that is reported [kg]
SURE_DEVIATIONS = 2.0  # number of standard deviations for a certain change [-]
VAGUE = 0.35  # deviation of the mass above which a motion teaches nothing [kg]
PUSHED = 3.0  # mean squared residual relative to noise above which something else pushed the arm [-]


@dataclass(frozen=True)
class Estimate:
    """Mass and centre of mass with covariance, in the units of `x`."""

    x: Floats  # mass [kg] and centre of mass [m], shape (4,)
    covariance: Floats  # covariance, shape (4, 4)

    @property
    def deviation(self) -> float:
        """Standard deviation of the mass [kg]."""
        return float(np.sqrt(self.covariance[0, 0]))


def _independent(x: Floats, mass: float, centre: float) -> Estimate:
    return Estimate(x, np.diag(np.square([mass, centre, centre, centre])))


@dataclass(frozen=True)
class Equations:
    """Linear equations of a motion, weighted by their noise."""

    at: Floats  # mass [kg] and centre of mass [m] of the linearisation, shape (4,)
    rows: Floats  # columns of mass, first moment, and all other uncertain quantities, shape (N n, 4 + k)
    bare: Floats  # torques of the arm without payload, shape (N n,)
    measured: Floats  # measured torques, shape (N n,)
    others: Floats  # prior deviations of the others and of sensor gains, shape (k + n,) [-]
    joints: int  # number n of joints

    def solve(self, prior: Estimate) -> Estimate | None:
        """Return mass and centre of mass, given a prior about `at`; None if pushed, or not finite."""
        if not (np.isfinite(self.rows).all() and np.isfinite(self.measured).all()):
            return None
        mass, per_kg = float(self.at[0]), self.rows[:, 0]
        right = self.measured - self.bare - mass * per_kg
        known = np.diag(np.concatenate([np.zeros(4), self.others**-2.0]))
        for _ in range(3):  # errors of first moments and gains grow with the mass
            scale = np.array([1.0, *[max(mass, LIGHT)] * 3])
            known[:4, :4] = np.linalg.inv(prior.covariance * np.outer(scale, scale))
            gains = _each((self.bare + mass * per_kg).reshape(-1, self.joints))
            rows = np.column_stack([self.rows, *(gain.ravel() for gain in gains)])
            square = rows.T @ rows
            found = np.linalg.solve(known + square, rows.T @ right)
            mass = float(self.at[0] + found[0])
        excess = float(np.mean((right - rows @ found) ** 2))
        if excess > PUSHED:
            return None
        covariance = np.linalg.inv(known + square / max(excess, 1.0))[:4, :4]
        return Estimate(self.at + found[:4] / scale, covariance / np.outer(scale, scale))


class PayloadStudent:
    """Tracks the payload from motion to motion; see `experience.Study`.

    A motion is first judged alone. If its mass agrees with the earlier estimate, both are combined as in a
    Kalman filter; otherwise the payload has changed and the earlier estimate is dropped.
    """

    def __init__(self, description: RobotDescription) -> None:
        drives = description.drives
        self._arm = Arm(description)
        self._links = self._arm.chain[:, BODY:].copy()
        self._friction, self._width = np.array(drives.coulomb_friction), drives.friction_width
        self._linear, self._rotors = drives.linear_friction, np.array(drives.rotor_inertia)
        self._noise = NOISE[0] * self._friction + NOISE[1] * np.array(description.limits.torque)
        still = np.zeros((1, description.joints))
        self._torques(0, self._links[0], still, still, still)  # loads compiled code, which takes many ticks
        self._own, self._rated = description.payload, description.limits.payload
        self._known: Estimate | None = None
        self._believed: Payload | None = None

    def study(self, motion: MotionRecord) -> PayloadLesson | None:
        """Return the carried payload if it certainly differs from the assumed one by more than `DEAD`."""
        believed = motion.beliefs.declared
        if not motion.whole or len(motion.moments) < MIN_BLOCKS * BLOCK:
            return None
        centre = np.array(believed.com if believed.mass >= LIGHT else self._own.com)
        known = self._known
        if known is None or believed != self._believed:
            known = _independent(np.array([believed.mass, *centre]), *DECLARED)
        self._believed = believed
        equations = self._equations(motion, known.x)
        alone = equations.solve(_independent(known.x, self._rated, CENTRE))
        if alone is None or alone.deviation > VAGUE:
            return None
        now = Estimate(known.x, known.covariance + _independent(known.x, *DRIFT).covariance)
        changed = abs(alone.x[0] - known.x[0]) > SURE_DEVIATIONS * np.hypot(alone.deviation, now.deviation)
        found = alone if changed else equations.solve(now)
        if (
            found is None or found.x[0] < -SURE_DEVIATIONS * found.deviation - DEAD
        ):  # something holds the arm up
            return None
        self._known = found
        return self._lesson(believed, found)

    def _lesson(self, believed: Payload, found: Estimate) -> PayloadLesson | None:
        mass, certain = float(found.x[0]), SURE_DEVIATIONS * found.deviation
        beyond = mass > self._rated + certain
        assumed = round(min(max(mass, 0.0), self._rated), 3)
        if not abs(assumed - believed.mass) > max(DEAD, certain):
            return None
        x, y, z = np.clip(found.x[1:], -FARTHEST, FARTHEST).round(4).tolist()
        why = f"the arm carries {mass:.2f} kg ± {found.deviation:.2f} kg, not {believed.mass:g} kg"
        if beyond:
            why += f", which is above its rating: {self._rated:g} kg are assumed"
        payload = Payload(mass=assumed, com=(x, y, z), inertia=self._inertia(assumed, believed))
        self._believed = payload
        return PayloadLesson(payload=payload, why=why, beyond=beyond)

    def _inertia(self, mass: float, believed: Payload) -> tuple[float, float, float, float, float, float]:
        """Scale the inertia of the assumed or the robot file's payload with the mass."""
        like = believed if believed.mass >= LIGHT else self._own
        xx, xy, xz, yy, yz, zz = (mass / like.mass * value if like.mass else 0.0 for value in like.inertia)
        return xx, xy, xz, yy, yz, zz

    def _equations(self, motion: MotionRecord, at: Floats) -> Equations:
        """Return a motion's equations about a mass [kg] and centre of mass [m], shape (4,)."""
        speeds = np.gradient(motion.q, PERIOD, axis=0)
        q, qd, measured = _means(motion.q), _means(speeds), _means(motion.moments)
        qdd, centre = np.gradient(qd, BLOCK * PERIOD, axis=0), at[1:]
        per_kg = self._payload(centre, q, qd, qdd)
        sides = [self._payload(centre + move, q, qd, qdd) - per_kg for move in 0.01 * np.eye(3)]
        links = [self._torques(link, self._links[link], q, qd, qdd) for link in range(q.shape[1])]
        sign = _means(speeds / self._width if self._linear else np.tanh(speeds / self._width))
        sharper = np.zeros_like(sign) if self._linear else _means(np.tanh(2.0 * speeds / self._width)) - sign
        at_rest = np.arange(len(q))[:, None] * BLOCK >= motion.stop
        friction = self._friction * np.array([sign, sharper, qd, at_rest * np.ones_like(q)])
        own = dict(zip(FRICTION, friction, strict=True))
        own["rotor"] = self._rotors * qdd
        columns = [column for values in own.values() for column in _each(values)] + links
        others = [UNKNOWN[name] for name in [*own, "link", "sensor"] for _ in links]
        slow = np.zeros_like(qd) if self._linear else np.exp(-np.square(qd / self._width))
        weight = 1.0 / np.hypot(self._noise, STICKING * self._friction * slow)
        weight[[0, -1]] = 0.0  # their accelerations are one-sided differences
        rows = np.stack([per_kg, *(side / 0.01 for side in sides), *columns], axis=-1)
        bare = np.sum(links, axis=0) + own["rotor"] + own["friction"]
        return Equations(
            at, (rows * weight[..., None]).reshape(measured.size, -1), (bare * weight).ravel(),
            (measured * weight).ravel(), np.array(others), joints=len(links),
        )  # fmt: skip

    def _payload(self, centre: Floats, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return the torques of a kilogram with its centre in the flange frame, shape (N, n) [N m/kg]."""
        x, y, z = centre.tolist()
        return self._torques(q.shape[1] - 1, self._arm.on_flange(Body(mass=1.0, com=(x, y, z))), q, qd, qdd)

    def _torques(self, link: int, body: Floats, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return the torques if only one link has mass, shape (N, n) [N m]."""
        self._arm.chain[:, BODY:] = 0.0
        self._arm.chain[link, BODY:] = body
        return self._arm.torques(q, qd, qdd)


def _means(values: Floats) -> Floats:
    blocks = len(values) // BLOCK
    return np.asarray(values[: blocks * BLOCK].reshape(blocks, BLOCK, -1).mean(axis=1))


def _each(values: Floats) -> list[Floats]:
    """Return one column set per joint that contains only its values."""
    return [values * (np.arange(values.shape[1]) == joint) for joint in range(values.shape[1])]


def experience_of(setup: Setup, later: Later = at_once, plan: Plans | None = None) -> Experience | None:
    """Return a robot's learning from its motions; None if it learns nothing."""
    if setup.adapt != "payload":
        return None
    return Experience(PayloadStudent(setup.description).study, later, plan)
