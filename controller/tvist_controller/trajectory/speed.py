"""Velocities of joints or tool, approached with constant acceleration."""

import math
from collections.abc import Iterator

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import locate, newton, pseudo_inverse, turn_into
from tvist_controller.trajectory.base import Floats, MotionLimits
from tvist_controller.trajectory.guided import Guided, StuckError
from tvist_controller.trajectory.limiter import TorqueMargin
from tvist_kernels.compiling import inlined
from tvist_plant.chain import WIDTH
from tvist_plant.plant import PERIOD

FOUND, IMPOSSIBLE, SINGULAR = 0, 1, 2

BENT_SHARE = 0.5
"""Fraction of joint acceleration available to the curvature of the joints' path at constant speed [-]."""
MORE = 1e-6  # relative excess of a limit that counts as rounding [-]
LOOK = 5.0  # ticks ahead over which the curvature is measured
FARTHEST_LOOK = 0.05  # largest joint angle over which the curvature is measured [rad]
SLOWEST = 0.01  # fraction of the commanded speed below which the tool is stuck [-]
CORRECTIONS = 4  # largest number of Newton steps
OFF = 1e-7  # permitted error of the tool's pose [m or rad]
FLAT = 1e-12  # factor of a rate treated as zero


@compiled_for_ticks
def fitting_rates(x: Floats, y: Floats, low: Floats, high: Floats) -> tuple[float, float]:
    """Return least and largest r with low ≤ x + r y ≤ high in all entries; if none, least > largest."""
    lowest, highest = -math.inf, math.inf
    for i in range(len(x)):
        if abs(y[i]) < FLAT:
            if not low[i] <= x[i] <= high[i]:
                return math.inf, -math.inf
            continue
        one, other = (low[i] - x[i]) / y[i], (high[i] - x[i]) / y[i]
        lowest, highest = max(lowest, min(one, other)), min(highest, max(one, other))
    return lowest, highest


@inlined
def rate_by_bend(
    chain: Floats, q: Floats, slope: Floats, u: Floats, ahead: float, acceleration: float
) -> float:
    """Return the rate that path curvature permits; `slope` becomes the larger of its values now and ahead.

    Near singular postures the joints' path bends, taking acceleration: second derivative times squared speed.
    """
    n = len(q)
    jacobian, inverse, later_q = np.empty((6, n)), np.empty((n, 6)), np.empty(n)
    for i in range(n):
        later_q[i] = q[i] + ahead * slope[i]
    locate(chain, later_q, np.empty((3, 3)), np.empty(3), jacobian)
    pseudo_inverse(jacobian, inverse)
    bend = 1e-9
    for i in range(n):
        later = 0.0
        for m in range(6):
            later += inverse[i, m] * u[m]
        bend = max(bend, abs(later - slope[i]) / ahead)
        slope[i] = max(abs(slope[i]), abs(later))
    return math.sqrt(BENT_SHARE * acceleration / bend)


@compiled_for_ticks
def speed_step(  # noqa: C901, PLR0912  a kernel: its branches are loops
    chain: Floats,  # to the tool centre point; no links if the velocities are those of the joints
    inverse: Floats,  # pseudo-inverse of the Jacobian in mid-tick, shape (n, 6); else the unit matrix
    joints: Floats,  # present positions [rad] and the step to them [rad], shape (2, n)
    velocities: Floats,  # at the beginning and the end, in the trajectory's own time, shape (2, 6) or (2, n)
    ranges: Floats,  # least and largest change of the joints' step, and largest step, shape (3, n) [rad]
    change: Floats,  # largest change of the velocity, shape (6,) or (n,)
    given: Floats,  # present and wanted rate [-], the joints' limits, `VelocityFollower._lag`, tick [s]
    place: Floats,  # present rotation and position of the tool, shape (4, 3)
    goal: Floats,  # result: rotation and position of the tool a tick later
    q: Floats,  # result: positions of the joints a tick later, shape (n,) [rad]
) -> tuple[int, float]:
    """Move for a tick at the mean of two velocities and the time rate that joint limits and curvature permit.

    Returns FOUND and final rate; IMPOSSIBLE if limits prevent the step; SINGULAR if curvature nearly does.
    """
    rate, speed, slowest, acceleration, lag, h = given[0], given[1], given[2], given[3], given[4], given[5]
    n, straight = len(q), chain.shape[0] > 0
    present, u = velocities[0], velocities[1]
    before, slope, after = np.zeros(n), np.zeros(n), np.empty(n)
    gained, kept, lost, fastest, sharpest = np.empty(n), np.empty(len(u)), np.empty(len(u)), 0.0, 0.0
    for i in range(n):
        for m in range(len(u)):
            before[i] += inverse[i, m] * (0.5 * h * rate * present[m])
            slope[i] += inverse[i, m] * u[m]
        after[i], gained[i] = 0.5 * h * slope[i], before[i] - joints[1, i]
        fastest = max(fastest, abs(slope[i]))
    for m in range(len(u)):
        kept[m], lost[m], sharpest = -rate * present[m], -change[m], max(sharpest, change[m])
    lowest, highest = fitting_rates(gained, after, ranges[0], ranges[1])
    if not straight and sharpest == 0.0:
        lowest = highest = rate  # joints may always keep their velocities
    if lowest > min(highest, max(rate, speed)) or highest < 0.0:
        return IMPOSSIBLE, rate
    least, most = fitting_rates(kept, u, lost, change)
    wanted = speed
    if wanted != rate:  # the present rate is possible, but for rounding
        wanted = min(max(wanted, least), most)
    if straight and fastest > 0.0:
        ahead = min(LOOK * h * max(wanted, SLOWEST), FARTHEST_LOOK / fastest)
        permitted = rate_by_bend(chain, joints[0], slope, u, ahead, acceleration)
        for i in range(n):
            fastest = max(fastest, slope[i])
        permitted = min(permitted, slowest / fastest)
        if permitted < SLOWEST:
            return SINGULAR, rate
        wanted = min(wanted, permitted)
    new = max(min(wanted, highest), lowest, 0.0)
    for i in range(n):
        q[i] = joints[0, i] + before[i] + new * after[i]
    if straight:
        mean = np.empty(6)
        for m in range(6):
            mean[m] = 0.5 * h * (rate * present[m] + new * u[m])
        for k in range(3):
            goal[3, k] = place[3, k] + mean[k]
        turn_into(mean[3:], place[:3], goal[:3])
        if not newton(chain, goal[:3], goal[3], inverse, CORRECTIONS, q, np.empty(6)) <= OFF:
            return IMPOSSIBLE, rate
    for i in range(n):
        step = q[i] - joints[0, i]
        bent = abs(step - joints[1, i]) > (1.0 + MORE) * lag * acceleration
        if bent or abs(step) > (1.0 + MORE) * ranges[2, i]:
            return IMPOSSIBLE, rate
    return FOUND, new


HALVINGS = 8  # number of times a velocity change may be halved if torque or joints do not permit it
TRIES = 4  # number of halvings tried per tick, starting at twice the last fraction
STANDING = 1e-6  # velocity below which joints count as standing when a motion is taken over [rad/s]
STEADY = 1e-12  # velocity below which a motion with nearly stopped time is at rest [rad/s or m/s]
ROUNDING = 1e-9  # fraction of a tick by which rounding may delay the end of a change [-]
USED = 0.95
"""Fraction of joint acceleration used to plan the tool; the rest is for curvature within a tick [-]."""
LOST_SHARE = 1e-3
"""Fraction of a twist in lost directions above which standing joints cannot start it; higher than the effect
of rounding and nearly singular postures [-]."""


class VelocityFollower(Guided):
    """Accelerates joints or tool to a velocity and keeps it.

    In the trajectory's own time, velocity u approaches its goal with constant acceleration, all entries in phase. The
    reference has velocity r u with the time rate r, so a constant rate scales velocities by r and accelerations by r².
    The rate changes as quickly as acceleration permits; jerk is not limited. Each tick moves by the mean of its initial
    and final velocities. If torque or joint limits do not suffice, the velocity changes less, still in phase.

    A tool moves straight: its pose is integrated and tracked by Newton's method, so it does not drift. Near singular
    postures the joints' path q(s) has a large second derivative; q'' ṡ² may use only a fraction of joint acceleration,
    which slows the tool down beforehand.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],  # to continue from, q, q̇ and q̈, each of shape (n,)
        limits: MotionLimits,  # of every joint; the jerk is that of stops
        torque: TorqueMargin,
        *,
        rate: float = 1.0,  # time rate, 0 to 1 [-]; more if joints are too fast for this rate at the start
        arm: Arm | None = None,  # the arm whose tool has the velocity; None for velocities of the joints
    ) -> None:
        self._q, self._qd, self._qdd = (np.array(values, dtype=float) for values in state)
        self._torque = torque
        self.adopt(limits)
        self.arm = arm  # the arm whose tool has the velocity; None for joint velocities
        n, fastest = len(self._q), float(np.abs(self._qd).max())
        # A tool continues from the actual step, even if the joints count as standing.
        self._step = PERIOD * (self._qd - 0.5 * PERIOD * self._qdd)
        if stands := fastest <= STANDING:
            self._qd = np.zeros(n)
        self.rate = max(rate, min(fastest / limits.velocity, 1.0))
        self._speed, self._slowest = rate, limits.velocity
        self._share = 1.0  # fraction of the acceleration tried last [-]
        self._chain, self._inverse = np.empty((0, WIDTH)), np.eye(n)
        self._place, moving = np.zeros((4, 3)), self._qd  # rotation and position of the tool, shape (4, 3)
        if arm is not None:
            rotation, position, jacobian = arm.located(self._q)
            self._chain, self._place, moving = arm.chain, np.vstack((rotation, position)), jacobian @ self._qd
        self._u = moving if stands else moving / self.rate
        self._goal = self._u
        self._most: tuple[float, ...] = (np.inf,)

    def aim(self, goal: Floats, *accelerations: float) -> None:
        """Approach other joint velocities [rad/s], or tool velocities in the base frame [m/s, rad/s].

        Accelerations: that of the joint that changes most [rad/s^2], or the tool's linear [m/s^2] and angular
        one [rad/s^2].
        """
        self._goal, self._most = np.array(goal, dtype=float), accelerations

    def come_to_rest(self) -> None:
        """Approach zero with the last command's acceleration, until the next command."""
        self._goal = np.zeros_like(self._goal)

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`; the jerk limit permits reversing the acceleration within a tick."""
        self._arm_limits, self.limits = limits, abrupt(limits)

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed; in motion, the rate changes from the next tick on."""
        self._speed, self._slowest = speed, self._arm_limits.velocity if slowest is None else slowest
        if not self._u.any():
            self.rate = self._wanted_rate

    @property
    def _wanted_rate(self) -> float:
        """Commanded rate, lowered to keep joint velocities; for tool velocities, `speed_step` lowers it."""
        if self.arm is not None:
            return self._speed
        fastest = max(float(np.abs(self._goal).max()), float(np.abs(self._u).max()))
        return self._speed if fastest <= self._slowest else min(self._speed, self._slowest / fastest)

    @property
    def _accelerations(self) -> Floats:
        """Accelerations in use: that of the joints, or linear and angular acceleration of the tool."""
        most = np.array(self._most)
        return most if self.arm is not None else np.minimum(most, self._arm_limits.acceleration)

    @property
    def duration(self) -> float:
        """Time until the velocity is reached at full speed [s]."""
        change = self._goal - self._u
        sizes = [np.abs(change).max()]
        if self.arm is not None:
            sizes = [np.linalg.norm(change[:3]), np.linalg.norm(change[3:])]
        return float((np.array(sizes) / self._accelerations).max())

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._q, self._qd, self._qdd

    @property
    def finished(self) -> bool:
        """Whether the commanded velocity is zero and has been reached."""
        return not (self._goal.any() or self._u.any())

    def next(self) -> Floats:
        """Advance by one tick and return the joint positions; raise StuckError if it cannot continue."""
        if self.finished:
            self._step = self._qd = self._qdd = np.zeros_like(self._q)
            return self._q
        h, limits = PERIOD, self._arm_limits
        if self.arm is None:
            self._step = h * self._qd
        else:
            jacobian, self._inverse = self.arm.inverse(self._q + 0.5 * self._step)
            lost, most = self._goal - jacobian @ (self._inverse @ self._goal), np.abs(self._goal).max()
            if not self._u.any() and np.abs(lost).max() > LOST_SHARE * most:
                raise StuckError(
                    "the joints cannot move the tool in its direction from this singular posture"
                )
        found = None
        ranges, duration = self._ranges(), self.duration
        most = np.repeat(self._accelerations, len(self._u) // len(self._most))
        for share in self._shares():
            time = share * self.rate * h
            part = 1.0 if duration <= time * (1.0 + ROUNDING) else time / duration
            u = self._goal if part == 1.0 else self._u + part * (self._goal - self._u)
            given = np.array((self.rate, self._wanted_rate, self._slowest, limits.acceleration, self._lag, h))
            place, q = np.empty((4, 3)), np.empty_like(self._q)
            status, rate = speed_step(
                self._chain, self._inverse, np.stack((self._q, self._step)), np.stack((self._u, u)), ranges,
                share * h * most, given, self._place, place, q,
            )  # fmt: skip
            if status == SINGULAR:
                raise StuckError("the tool cannot continue in its direction near a singular posture")
            if status == FOUND:
                found = q, u, rate, place
                if self._torque.allows(self._q, self._step / h, (q - self._q - self._step) / self._lag):
                    break
        if found is None:
            raise StuckError("the joints' limits do not let the tool continue in its direction")
        self._take(*found)
        return self._q

    @property
    def _lag(self) -> float:
        """Factor from acceleration to change of a tick's step [s^2]: h²/2 for joints, h² for the tool."""
        return (0.5 if self.arm is None else 1.0) * PERIOD**2

    def _ranges(self) -> Floats:
        """Return least and largest change of each joint's step, and largest step, shape (3, n) [rad].

        Acceleration away from zero is limited so that a stop can keep the velocity limit.
        """
        h, limits, speed = PERIOD, self._arm_limits, np.abs(self._qd)
        most = (1.0 + ROUNDING if self.arm is None else USED) * limits.acceleration
        # A stop ends the present acceleration with limited jerk; meanwhile the joint gets faster. Two ticks
        # are reserved, as the newest reference's acceleration is known only as the mean of two ticks.
        left, two = np.maximum(limits.velocity - speed, 0.0), 2.0 * h
        rise = limits.jerk * (np.sqrt(two * two + 2.0 * left / limits.jerk) - two)
        rise = np.minimum(np.minimum(rise, limits.acceleration), most)
        up, down = np.where(self._qd > 0.0, rise, most), np.where(self._qd < 0.0, rise, most)
        return np.stack((-down * self._lag, up * self._lag, h * np.maximum(limits.velocity, speed)))

    def _shares(self) -> Iterator[float]:
        """Yield fractions of the acceleration to try in a tick, finally 0, so that no tick takes long [-]."""
        top = min(max(2.0 * self._share, 0.5**HALVINGS), 1.0)
        for halved in range(TRIES):
            self._share = top * 0.5**halved
            yield self._share
        self._share = 0.0
        yield 0.0

    def _take(self, q: Floats, u: Floats, rate: float, place: Floats) -> None:
        h, step = PERIOD, q - self._q
        self._qdd = (step - self._step) / self._lag
        self._qd = step / h + 0.5 * h * self._qdd if self.arm is not None else rate * u
        self._q, self._step, self._u, self.rate, self._place = q, step, u, rate, place
        if not self._goal.any() and float(np.abs(rate * u).max()) <= STEADY:
            self._u = np.zeros_like(u)


def abrupt(limits: MotionLimits) -> MotionLimits:
    """Return limits with which joints may reverse their acceleration within a tick."""
    return MotionLimits(limits.velocity, limits.acceleration, 2.0 * limits.acceleration / PERIOD)
