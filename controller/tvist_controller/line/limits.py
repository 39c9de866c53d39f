"""Limits of velocity and torque."""

import math

import numpy as np
import numpy.typing as npt

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats, Target, central_differences
from tvist_controller.trajectory import AnyStop, MotionLimits, Path
from tvist_plant.chain import collect_inertia, torques
from tvist_plant.description import RobotDescription
from tvist_plant.plant import GRAVITY, PERIOD

TORQUE_SHARE = 0.9
"""Fraction of the joint torque limits available to a stop or stream [-]."""
REBOUND = 1.0
"""Overshoot of a flexible arm's torque relative to a sudden change of the rigid arm's torque: 1 without
damping [-]. Stops bypass the filter, so their change is sudden."""
GENTLEST_STOP = 1.0  # lowest deceleration of a stop [rad/s^2]

MOMENTS = 32  # number of moments at which a stop's torque is checked
_SHARES = np.arange(1, MOMENTS + 1) / MOMENTS
_POINTS = np.linspace(0.0, 1.0, 17)[:, np.newaxis]  # fractions of a path at which its torque is checked
LOOK_EVERY = 4  # ticks between torque checks along known references
REDUCED_SHARE = 0.25  # fraction of joint velocity that remains in reduced mode [-]


def arm_limits(description: RobotDescription) -> MotionLimits:
    """Return limits that hold for every joint: the smallest of each."""
    limits = description.limits
    return MotionLimits(min(limits.velocity), min(limits.acceleration), min(limits.jerk))


def rate_of(speed: float, velocity: float, slowest: float | None) -> float:
    """Return a motion's time rate [-] for this peak velocity; `slowest`: reduced mode's limit, if active."""
    return speed if slowest is None else min(speed, slowest / velocity)


@compiled_for_ticks
def keeps_torque(chain: Floats, q: Floats, qd: Floats, qdd: Floats, scratch: Floats, most: Floats) -> bool:
    """Return whether a state keeps torques within `most`, (n,) [N m]; see `tvist_plant.chain.torques`."""
    found = np.empty(q.shape[0])
    torques(chain, q, qd, qdd, GRAVITY, scratch, found)
    keeps = True
    for j in range(q.shape[0]):
        keeps = keeps and abs(found[j]) <= most[j]
    return keeps


@compiled_for_ticks
def torque_room(chain: Floats, q: Floats, qd: Floats, scratch: Floats, most: Floats, share: float) -> float:
    """Return the acceleration all joints may have at once, in any directions, within torques `most` [N m].

    The torque of acceleration is multiplied by `share`; other arguments as in `tvist_plant.chain.torques`.
    """
    n, least = q.shape[0], math.inf
    found, M = np.zeros(n), np.empty((n, n))
    torques(chain, q, qd, np.zeros(n), GRAVITY, scratch, found)
    collect_inertia(scratch, M)
    for i in range(n):
        pushed = 0.0
        for j in range(n):
            pushed += abs(M[min(i, j), max(i, j)])
        least = min(least, (most[i] - abs(found[i])) / (share * pushed))
    return least


class StreamTorqueMargin:
    """Acceleration of a stream or guided motion within the joint torques left by gravity and velocity.

    An unshaped guided motion may change suddenly. The torque of the flexible arm then overshoots that of the
    rigid arm by the fraction `rebound`, and must also stay within the limits.
    """

    def __init__(
        self, description: RobotDescription, dynamics: InverseDynamics, rebound: float = 0.0
    ) -> None:
        self._limits, self._rebound = np.array(description.limits.torque), rebound
        self._most = TORQUE_SHARE * self._limits
        self._dynamics = dynamics

    def allows(self, q: Floats, qd: Floats, qdd: Floats) -> bool:
        """Return whether a state keeps all torque limits, or has at most the gentlest stop's acceleration."""
        swung = (1.0 + self._rebound) * qdd
        keeps = self._keeps(q, qd, qdd, self._most) and (
            self._rebound == 0.0 or self._keeps(q, qd, swung, self._limits)
        )
        return keeps or bool(np.abs(qdd).max() <= GENTLEST_STOP)

    def acceleration(self, q: Floats, qd: Floats) -> float:
        """Return the largest a such that every |q̈ᵢ| ≤ a is allowed, at least `GENTLEST_STOP` [rad/s^2].

        With τ = M q̈ + h, any q̈ with |q̈ᵢ| ≤ a needs at most the torque |hᵢ| + a Σⱼ|Mᵢⱼ| at joint i.
        """
        room = self._room(q, qd, self._most, 1.0)
        if self._rebound > 0.0:
            room = min(self._room(q, qd, self._limits, 1.0 + self._rebound), room)
        return max(room, GENTLEST_STOP)

    def _keeps(self, q: Floats, qd: Floats, qdd: Floats, most: Floats) -> bool:
        dynamics = self._dynamics
        if dynamics.changing:
            return bool((dynamics.effort(q, qd, qdd) <= most).all())
        return keeps_torque(dynamics.chain, q, qd, qdd, dynamics.scratch, most)

    def _room(self, q: Floats, qd: Floats, most: Floats, share: float) -> float:
        dynamics = self._dynamics
        if dynamics.changing:
            left = most - dynamics.effort(q, qd, np.zeros_like(q))
            return float((left / (share * np.abs(dynamics.inertia(q)).sum(axis=1))).min())
        return torque_room(dynamics.chain, q, qd, dynamics.scratch, most, share)


class StopTorque:
    """Joint torques available to a stop from a state.

    The rigid arm's torques stay within a share of the limits. If the uninterrupted motion needs more
    (`asked`, by default the torque at the start), they stay within that instead.
    """

    def __init__(
        self, dynamics: InverseDynamics, state: Target, limits: Floats, asked: Floats | None = None
    ) -> None:
        self._dynamics = dynamics
        if asked is None:
            asked = dynamics.effort(state.q, state.qd, state.qdd)
        self._share, self._most = np.maximum(TORQUE_SHARE * limits, asked), np.maximum(limits, asked)
        self._before = dynamics.torque(state.q, state.qd, state.qdd) - dynamics.gravity(state.q)
        self._failed: int | None = None  # moment at which the last failing stop exceeded the torques

    def holds(self, stop: AnyStop, *, rebound: bool = True) -> bool:
        """Return whether a stop keeps these torques and, with `rebound`, its overshoot keeps the limits.

        Torque peaks where a joint's acceleration ramp ends, so 32 moments are checked. Two come first: the
        end of the ramp to the full deceleration, where nine in ten failing stops fail; and the moment at
        which the previous stop failed, since the next one mostly fails there, too.
        """
        ramp = stop.acceleration / stop.jerk
        ends = min(math.ceil(ramp / stop.duration * MOMENTS), MOMENTS) if stop.duration > 0.0 else MOMENTS
        times = _SHARES * stop.duration
        firsts = ends - 1 if self._failed is None else [self._failed, ends - 1]
        if not self._within(stop, times[firsts].reshape(-1), rebound=rebound).all():
            return False
        within = self._within(stop, times, rebound=rebound)
        if not within.all():
            self._failed = int(np.argmin(within))
        return bool(within.all())

    def _within(self, stop: AnyStop, times: Floats, *, rebound: bool) -> npt.NDArray[np.bool_]:
        """Return at which of k times a stop keeps the torques, shape (k,)."""
        q, torque, effort = self._torques(stop, times)
        within = np.asarray((effort <= self._share).all(axis=1))
        if not rebound or not within.any():
            return within
        gravity = self._dynamics.gravities(q)
        motion = torque - gravity
        begun = np.abs(torque + REBOUND * (motion - self._before))
        ended = np.abs(gravity - REBOUND * motion)
        within &= (np.maximum(begun, ended) <= self._most).all(axis=1)
        return within

    def peaks(self, stop: AnyStop) -> Floats:
        """Return the largest torque of each joint at any tick of a stop, shape (n,) [N m]."""
        times = PERIOD * np.arange(1.0, math.ceil(stop.duration / PERIOD) + 1.0)
        return np.asarray(self._torques(stop, times)[2].max(axis=0, initial=0.0))

    def excess(self, peaks: Floats) -> float:
        """Return the largest ratio of these torques to what `holds` permits [-]."""
        return float((peaks / self._share).max())

    def _torques(self, stop: AnyStop, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions, torques and largest absolute torques of any body at k times, each (k, n)."""
        dynamics = self._dynamics
        q, qd, qdd = stop.states(times)
        torque = dynamics.torques(q, qd, qdd)
        if not dynamics.changing:
            return q, torque, np.abs(torque)
        effort = [dynamics.effort(*state) for state in zip(q, qd, qdd, strict=True)]
        return q, torque, np.array(effort)


def acceleration_on_way(
    dynamics: InverseDynamics, path: Path, start: Floats, way: Floats, velocity: float, limits: Floats
) -> float:
    """Return the largest acceleration of a path's parameter that keeps torques within their share [rad/s^2].

    Along q(x) the torque is m(x) ẍ + c(x) ẋ² + g(x), which is largest at a corner of the range of ẋ² and ẍ.
    This is checked at 17 points of `way` from `start`, both of shape (m,); `limits` are the joints' torque
    limits.
    """
    farthest, x = float(np.abs(way).max()), start + _POINTS * way
    still = np.zeros_like(x)
    along = still + (way / farthest if farthest > 0.0 else 0.0)
    gravity = dynamics.gravities(path.states(x, still, still)[0])
    resting = np.maximum(np.abs(gravity), np.abs(dynamics.torques(*path.states(x, velocity * along, still))))
    pushed = np.abs(dynamics.torques(*path.states(x, still, along)) - gravity)
    return max(float(((TORQUE_SHARE * limits - resting) / np.maximum(pushed, 1e-9)).min()), 0.0)


def torque_along(dynamics: InverseDynamics, references: Floats) -> Floats:
    """Return largest joint torques along references (k >= 3, n) [rad], by central differences, (n,) [N m]."""
    q, qd, qdd = central_differences(references)
    looked = np.append(np.arange(0, len(q) - 1, LOOK_EVERY), len(q) - 1)
    states = zip(q[looked], qd[looked], qdd[looked], strict=True)
    return np.asarray(np.max([dynamics.effort(*state) for state in states], axis=0))
