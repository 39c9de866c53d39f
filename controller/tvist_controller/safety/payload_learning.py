"""Learning of the carried payload: records motions, studies them outside the ticks, applies lessons at rest.

For means over 20 ms, the torques of an arm with mass m and its centre at c + d are
    τ = Y_l(q, q̇, q̈) 1 + B q̈ + F(q̇) + Y_m m + Y_c m d
Y_l has a column per link, Y_m is that of a kilogram at c, by inverse dynamics at the *measured* angles, so
that springs and drive gains are not needed. All other uncertain quantities are estimated with m and m d, with
the prior deviations `UNKNOWN`: they reduce certainty instead of appearing as a mass.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.line_tick import Sample
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.setup import Setup
from tvist_plant.chain import BODY
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_plant.user_file import named
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.values import Payload

LONGEST = 10_000  # longest recorded motion; longer ones are dropped [ticks]
AFTER = 150  # recording time after the end of a motion, for the ring-down [ticks]
WAITING = 16  # largest number of waiting studies; further motions are not studied
BLOCK = 10  # ticks averaged per block
MIN_BLOCKS = 20  # smallest number of blocks of a motion
UNKNOWN = {  # prior deviations per joint [-]
    "friction": 0.2,  # Coulomb friction, relative
    "friction's width": 1.0,  # effect of half its width
    "viscous friction": 0.3,  # at 1 rad/s, relative to Coulomb friction
    "sensor": 0.03,  # gain of the torque sensor
    "standing": 0.3,  # friction at rest
    "link": 0.03,  # mass of the link
    "rotor": 0.2,  # rotor inertia
}
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
VAGUE = 0.35  # standard deviation of the mass above which a motion's estimate is not used [kg]
PUSHED = 3.0  # mean squared residual relative to noise above which something else pushed the arm [-]


@dataclass(frozen=True)
class MotionRecord:
    """A motion of T ticks with its ring-down."""

    q: Floats  # measured joint angles, shape (T, n) [rad]
    moments: Floats  # measured motor torques on the joint side, shape (T, n) [N m]
    stop: int  # number of ticks until the commands came to rest
    whole: bool  # whether it was a shaped motion from rest to rest, without stop, stream or bypass
    beliefs: FilterState  # state of filter and payload assumed by the controller


@dataclass
class _Motion:
    beliefs: FilterState  # state assumed by the controller at the motion's start
    samples: list[Sample] = field(default_factory=list)
    stop: int = 0  # as in `MotionRecord`; 0 while the arm moves
    whole: bool = True

    def record(self) -> MotionRecord:
        """Return the record of the completed motion, which takes longer than a tick."""
        q = np.array([sample.measured.q for sample in self.samples])
        moments = np.array([sample.measured.moment for sample in self.samples])
        return MotionRecord(q, moments, self.stop, self.whole, self.beliefs)


Later = Callable[[Callable[[], None]], Callable[[], bool]]
"""Starts a study outside the ticks; returns a function that tells whether it has ended."""
Study = Callable[[MotionRecord], PayloadLesson | None]
"""Returns the lesson of a motion, None without one; called by one thread at a time. The journal contains all
lessons, so a replay studies nothing."""
Plans = Callable[[PayloadLesson, FilterState], Plan]  # plans the change that a lesson requires


def at_once(work: Callable[[], None]) -> Callable[[], bool]:
    """Study within the tick, for the clocks lockstep and free, with which a tick may take any time."""
    work()
    return lambda: True


class LessonRecord(NamedTuple):
    """A lesson, and the controller's assumptions for which it is valid."""

    beliefs: FilterState  # state assumed by the controller during the motion
    lesson: PayloadLesson  # what was learnt
    plan: Plan | None  # plan for the lesson; None if not yet planned


class PayloadLearning:
    """Learning from a robot's motions, recorded one after the other and studied in order."""

    def __init__(
        self,
        study: Study,
        later: Later = at_once,  # runs a study in parallel
        plan: Plans | None = None,  # plans the changes of a lesson; None to plan in the tick that applies it
    ) -> None:
        self._study, self._later, self._plan = study, later, plan
        self._motion: _Motion | None = None  # the motion that is being recorded
        self._under_way: list[tuple[Callable[[], bool], list[LessonRecord]]] = []
        self._raised: list[Exception] = []
        self._reported = set[str]()
        self._placements = 0

    def watch(
        self,
        sample: Sample,
        present: Callable[[], FilterState],  # the controller's assumptions about the arm
        *,
        held: bool,  # whether the drives hold the arm
        placements: int,  # number of times that the arm was placed, see `ControlCycle`
    ) -> None:
        """Take a tick."""
        if placements != self._placements or not held:
            self._placements, self._motion = placements, None
        ended = self._record(sample, present) if held else None
        if ended is None or len(self._under_way) >= WAITING:
            return
        learnt: list[LessonRecord] = []

        def study() -> None:
            try:
                motion = ended.record()
                if (lesson := self._study(motion)) is not None:
                    plan = None if self._plan is None else self._plan(lesson, motion.beliefs)
                    learnt.append(LessonRecord(motion.beliefs, lesson, plan))
            except Exception as error:  # noqa: BLE001  the robot goes on without the lesson, and `raised` reports it
                self._raised.append(error)

        self._under_way.append((self._later(study), learnt))

    def _record(self, sample: Sample, present: Callable[[], FilterState]) -> _Motion | None:
        """Record a tick with drives on, and `present()` as a motion begins; return any motion it ends."""
        resting, done, motion = sample.mode.at_rest, None, self._motion
        if not resting and (motion is None or motion.stop):
            done, motion = motion, _Motion(present())
            self._motion = motion
        if motion is None:
            return None
        motion.whole = motion.whole and (resting or sample.mode is LineMode.SHAPED)
        if len(motion.samples) < LONGEST + AFTER:
            motion.samples.append(sample)
        if resting and not motion.stop:
            motion.stop = len(motion.samples)
            if motion.stop > LONGEST:  # too long to learn from: the samples would take 20 MB
                self._motion = None
        if motion.stop and len(motion.samples) == motion.stop + AFTER:
            done, self._motion = motion, None
        return done

    def void(self) -> None:
        """Drop all studies in progress: they no longer apply after `forget` or another load."""
        self._under_way = []

    def lessons(self) -> Iterator[LessonRecord]:
        """Yield the lessons of finished studies once; call while the arm rests."""
        while self._under_way and self._under_way[0][0]():
            yield from self._under_way.pop(0)[1]

    def raised(self) -> Sequence[Exception]:
        """Return new exceptions of studies, each message only once."""
        if not self._raised:
            return ()
        raised, self._raised = self._raised, []
        new = [error for error in raised if named(error) not in self._reported]
        self._reported.update(map(named, new))
        return new


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
        """Find mass and centre of mass from a prior around `at`; None if pushed, or a value is not finite."""
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


class PayloadEstimator:
    """Tracks the payload from motion to motion; see `Study`.

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
        """Return the payload, if it certainly differs from the assumed one by more than `DEAD`, else None."""
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
        if found is None or found.x[0] < -SURE_DEVIATIONS * found.deviation - DEAD:
            return None  # something holds the arm up
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
        like = believed if believed.mass >= LIGHT else self._own  # its inertia is scaled with the mass
        xx, xy, xz, yy, yz, zz = (assumed / like.mass * value if like.mass else 0.0 for value in like.inertia)
        payload = Payload(mass=assumed, com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))
        self._believed = payload
        return PayloadLesson(payload=payload, why=why, beyond=beyond)

    def _equations(self, motion: MotionRecord, at: Floats) -> Equations:
        """Return a motion's equations, linearised at a mass [kg] and centre of mass [m], shape (4,)."""
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
    """Return per joint a copy of the values (k, n) in which those of all other joints are zero."""
    return [values * (np.arange(values.shape[1]) == joint) for joint in range(values.shape[1])]


def payload_learning_of(
    setup: Setup, later: Later = at_once, plan: Plans | None = None
) -> PayloadLearning | None:
    """Return a robot's learning from its motions; None if it learns nothing."""
    if setup.adapt != "payload":
        return None
    return PayloadLearning(PayloadEstimator(setup.description).study, later, plan)
