"""Limiter of a stream's velocity, acceleration, jerk and torque; streams within limits pass unchanged."""

import math
from typing import Protocol

import numpy as np
import numpy.typing as npt
import ruckig

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.trajectory.base import Floats, MotionLimits
from tvist_plant.plant import PERIOD

Bools = npt.NDArray[np.bool_]

STOPS = 0.8
"""Fraction of the acceleration allowed by torque with which a joint must be able to stop in range; the margin
is for changes on the way [-]."""
HEAVY = 8.0  # acceleration below which torque hardly ever limits a joint [rad/s^2]
TOLERANCE = 1e-6  # relative excess of a limit that counts as rounding [-]
ROUNDING = 2e-15  # error of differences due to rounding of positions [rad]
STEP, BEND, QD, QDD, DIFFERENCES = range(5)
"""Rows of differences: first and second [rad], then as velocity and acceleration; number of rows."""
FIT, FAR = 1, 2  # bits of `judge`: all joints fit; all are far from the ends of their range


@compiled_for_ticks
def judge(
    q: Floats,  # shape (n,) [rad]
    last: Floats,  # a tick earlier
    before: Floats,  # differences a tick earlier, shape (4, n), see `DIFFERENCES`
    velocity: float,  # limits of the first, second and third difference [rad]
    acceleration: float,
    jerk: float,
    h: float,  # tick [s]
    inner: float,  # largest position that is far from the ends of the range [rad]
    now: Floats,  # result: differences, shape (4, n)
    fits: Bools,  # result: which joints fit, shape (n,)
) -> int:
    """Find joints whose differences keep limits now and can later; return `FIT`, `FAR`, their sum, or 0."""
    fastest = (1.0 + TOLERANCE) * velocity + ROUNDING
    hardest = (1.0 + TOLERANCE) * acceleration + 2.0 * ROUNDING
    harshest = (1.0 + TOLERANCE) * jerk + 4.0 * ROUNDING
    far, free = True, True
    for j in range(q.shape[0]):
        step = q[j] - last[j]
        bend = step - before[STEP, j]
        now[STEP, j], now[BEND, j], now[QD, j], now[QDD, j] = step, bend, step / h, bend / (h * h)
        size, turn = abs(step), abs(bend)
        fits[j] = size <= fastest and turn <= hardest and abs(bend - before[BEND, j]) <= harshest
        if size + turn * turn * (0.5 / jerk) > fastest:
            free = False
        if not abs(q[j]) <= inner:
            far = False
    found = FAR if far else 0
    fit = True
    for j in range(q.shape[0]):
        step, bend = now[STEP, j], now[BEND, j]
        if not free:
            # Velocity at the time when the acceleration, reduced by a tick's worth of jerk per tick, has reached
            # zero.
            turn, sign = abs(bend), np.sign(bend)
            ticks = np.floor(turn / jerk)
            towards = step * sign + ticks * (turn - 0.5 * jerk * (ticks + 1.0))
            # If the acceleration is rising, check its present value as well, since limiting would start from that.
            rise = (bend - before[BEND, j]) * sign
            present = turn + rise
            reached = step * sign + turn / 6.0 + present / 3.0 + present * present * (0.5 / jerk)
            falls = rise <= TOLERANCE * jerk + 4.0 * ROUNDING
            stays = falls or reached <= fastest + 2.0 * turn
            fits[j] = fits[j] and towards <= fastest + TOLERANCE * turn and stays
        fit = fit and fits[j]
    return found + FIT if fit else found


class TorqueMargin(Protocol):
    """Tells which motion the joint torques permit."""

    def allows(self, q: Floats, qd: Floats, qdd: Floats) -> bool:
        """Return whether a state keeps the permitted torques."""

    def acceleration(self, q: Floats, qd: Floats) -> float:
        """Return the largest acceleration that all joints may have at once, in any direction [rad/s^2]."""


class Limiter:
    """Follows a position signal exactly while within limits; otherwise catches up time-optimally.

    Limits apply to first, second and third differences. A signal within limits passes unchanged to the last
    bit. So does a motion whose derivatives keep the limits, because differences are means of derivatives.
    A signal is too fast if its velocity would exceed the limit before its acceleration can return to zero,
    and too far if it could not stop in range.

    Joints are limited independently. A joint that lags is controlled relative to the signal's position,
    velocity and acceleration, and so catches up with a moving signal.
    """

    ADVANTAGE = 0.001
    """Fraction of the velocity limit by which a lagging joint may always be faster than its signal [-]."""
    NEAR = 1e-4  # permitted overshoot over a braking signal [rad]
    HOPELESS = 0.95  # fraction of a limit above which a signal is at the limit [-]
    AUTHORITY = 0.001  # fraction of the acceleration limit reserved for catching up [-]

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],  # q, q̇ and q̈ to start from, each of shape (n,)
        limits: MotionLimits,
        reach: Floats,  # largest |q| of each joint, shape (n,) [rad]
        torque: TorqueMargin | None,  # None for no limit
    ) -> None:
        (q, qd, qdd), n = state, len(state[0])
        self._limits = limits
        self._reach = np.array(reach, dtype=float)
        self._torque = torque
        self.q = np.array(q, dtype=float)  # position of the reference, shape (n,) [rad]
        # Velocity of the signal; second difference of the reference a tick earlier; present differences.
        self._signal_qd, self._bend_before, self._now = qd, PERIOD * PERIOD * qdd, np.zeros((DIFFERENCES, n))
        self._now[STEP], self._now[BEND] = PERIOD * (qd - 0.5 * PERIOD * qdd), self._bend_before
        self._state: Floats | None = np.stack(
            state
        )  # position and derivatives of the reference, if these differ from its differences
        self._behind: Bools | None = None  # which joints are not on the signal, if any
        self.behind = 0.0  # lag of joints that cannot catch up with a signal at its limits [s]
        # At positions smaller than this, no state within the limits needs a check of the range.
        slow = limits.acceleration if torque is None else min(limits.acceleration, HEAVY)
        ramp, swing = limits.acceleration / limits.jerk, limits.velocity / slow
        lasting = max(swing + ramp, 2.0 * math.sqrt(limits.velocity / limits.jerk))
        inner = float(self._reach.min()) - 2.0 * limits.velocity * (ramp + lasting)
        self._most = (
            limits.velocity * PERIOD, limits.acceleration * PERIOD**2, limits.jerk * PERIOD**3, PERIOD, inner,
        )  # fmt: skip
        self._catcher, self._brake = ruckig.Ruckig(n, PERIOD), ruckig.Ruckig(n, PERIOD)
        self._catch_request, self._brake_request = ruckig.InputParameter(n), ruckig.InputParameter(n)
        self._brake_request.control_interface = ruckig.ControlInterface.Velocity
        for request in (self._catch_request, self._brake_request):
            request.target_position = request.target_velocity = request.target_acceleration = [0.0] * n
            request.max_jerk = [limits.jerk] * n
            request.synchronization = ruckig.Synchronization.No

    @property
    def limited(self) -> bool:
        """Whether the reference differs from the signal."""
        return self._behind is not None

    @property
    def resting(self) -> bool:
        """Whether the last two positions were equal."""
        return not self._now[STEP].any()

    def follow(self, q: Floats, qd: Floats) -> Floats:
        """Advance by one tick towards a moving position; return the reference, shape (n,) [rad]."""
        now, fits = np.empty((DIFFERENCES, len(q))), np.empty(len(q), dtype=np.bool_)
        found = judge(q, self.q, self._now, *self._most, now, fits)
        if self._behind is not None:
            fits &= ~self._behind | self._meets(qd, now)
        if not found & FAR:
            fits &= self._stoppable(self._passed(q, now), self._accelerations()[1])
        passes = (found == FIT | FAR and self._behind is None) or bool(fits.all())
        self.behind = 0.0
        if passes and (self._torque is None or self._torque.allows(q, now[QD], now[QDD])):
            self._state = self._behind = None
        else:
            self._state, fits = self._held_back(q, qd, self._passed(q, now), fits)
            self._behind = None if fits.all() else ~fits
            q = self._state[0]
            now[STEP] = q - self.q
            now[BEND] = now[STEP] - self._now[STEP]
        self._signal_qd, self._bend_before, self._now = qd, self._now[BEND], now
        self.q = q
        return q

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        if self._state is None:
            self._state = self._passed(self.q, self._now, self._bend_before)
        q, qd, qdd = self._state
        return q, qd, qdd

    def _passed(self, q: Floats, now: Floats, bend_before: Floats | None = None) -> Floats:
        """Return state (3, n) of joints exactly on the signal, by a cubic through the last four positions."""
        h, limit, step, bend = PERIOD, self._limits.acceleration, now[STEP], now[BEND]
        change = bend - (self._now[BEND] if bend_before is None else bend_before)
        mean = bend / (h * h)
        # The mean acceleration was within the limit, so the present one is clamped to the limit as well.
        qdd = np.clip(mean + change / (h * h), np.minimum(mean, -limit), np.maximum(mean, limit))
        return np.stack((q, step / h + h * (mean / 6.0 + qdd / 3.0), qdd))

    def _meets(self, qd: Floats, now: Floats) -> Bools:
        """Return the joints that, if they were placed on the signal now, could follow it within limits."""
        h, limits, step, bend = PERIOD, self._limits, now[STEP], now[BEND]
        signal = self._signal_acceleration(qd, limits.acceleration)
        following = (qd - step / h) / h + 0.5 * signal  # second difference at the next tick
        meets: Bools = np.abs(following) <= limits.acceleration
        meets &= np.abs(following - bend / (h * h)) <= limits.jerk * h
        meets &= np.abs(following - signal) <= limits.jerk * h
        return meets

    def _accelerations(self) -> tuple[float, float]:
        """Return the acceleration permitted now and one with which a stop is certainly possible [rad/s^2]."""
        limit = self._limits.acceleration
        room = math.inf if self._torque is None else self._torque.acceleration(*self.state[:2])
        return min(limit, room), min(limit, STOPS * room)

    def _stoppable(self, state: Floats, limit: float) -> Bools:
        """Return which joints could still stop in range at `limit` [rad/s^2] if they started in two ticks."""
        (q, qd, qdd), jerk = state, self._limits.jerk
        sign = np.sign(qd)
        speed, rise = np.abs(qd), sign * qdd
        ramp = np.abs(rise) / jerk
        # Shortest stop from zero acceleration, plus or minus the distance between its start and the present state.
        top = speed + 0.5 * jerk * ramp**2
        gentle = top < limit**2 / jerk
        swing = top / limit + limit / jerk
        stop = top * np.where(gentle, np.sqrt(top / jerk), 0.5 * swing)
        rising = speed * ramp + jerk * ramp**3 / 3.0
        falling = top * ramp - jerk * ramp**3 / 6.0
        way = stop + np.where(rise > 0.0, rising, -falling)
        way = np.where((rise < 0.0) & (speed <= 0.5 * jerk * ramp**2), speed * ramp, way)
        inside: Bools = sign * q + way + 2.0 * PERIOD * speed <= self._reach
        inside |= sign * q <= sign * self.q
        return inside

    def _time_behind(self, q: Floats, qd: Floats, reference: Floats) -> float:
        limits, speed = self._limits, np.abs(qd)
        at_limit = np.abs(qd - self._signal_qd) > self.HOPELESS * limits.acceleration * PERIOD
        at_limit |= speed > self.HOPELESS * limits.velocity
        at_limit &= speed > (1.0 - self.HOPELESS) * limits.velocity
        times = np.where(at_limit, (q - reference) * np.sign(qd), 0.0) / np.maximum(speed, 1e-9)
        return float(times.max())

    def _signal_acceleration(self, qd: Floats, limit: float) -> Floats:
        most = (1.0 - self.AUTHORITY) * limit
        return np.asarray(np.clip((qd - self._signal_qd) / PERIOD, -most, most))

    def _held_back(self, q: Floats, qd: Floats, passed: Floats, fits: Bools) -> tuple[Floats, Bools]:
        """Return the state (3, n) when not all joints pass the signal unchanged, and which joints do."""
        limits, (limit, sure) = self._limits, self._accelerations()
        state = passed if fits.all() else np.where(fits, passed, self._catch_up(q, qd, limit, fits))
        if self._torque is not None and not self._torque.allows(*state):
            gentle = fits & (np.abs(passed[2]) <= limit)
            if (gentle != fits).any():
                fits = gentle
                state = np.where(fits, passed, self._catch_up(q, qd, limit, fits))
        sign = np.sign(state[2])
        fast = sign * state[1] + state[2] ** 2 / (2.0 * limits.jerk) > limits.velocity
        # Close to a signal at rest near the end of the range, no spare ticks are needed.
        lands = (qd == 0.0) & (np.abs(q) <= self._reach) & (np.abs(q - self.q) <= self.NEAR)
        for astray, goal in (
            (fast, sign * limits.velocity),
            (~(self._stoppable(state, sure) | lands), np.zeros_like(q)),
        ):
            held = astray & ~fits
            if held.any():
                state = np.where(held, self._change_to(goal, limit), state)
        self.behind = self._time_behind(q, qd, state[0])
        return state, fits

    def _catch_up(self, q: Floats, qd: Floats, limit: float, fits: Bools) -> Floats:
        """Return the state (3, n) a tick later as joints catch up with a signal of constant acceleration."""
        request, limits, h = self._catch_request, self._limits, PERIOD
        fastest = (1.0 - self.ADVANTAGE) * limits.velocity
        present = self.state
        qdd = self._signal_acceleration(qd, limit)
        qd = np.clip(qd, -fastest, fastest)
        request.enabled = (~fits).tolist()
        request.current_position = (present[0] - (q - h * (qd - 0.5 * h * qdd))).tolist()
        request.current_velocity = (present[1] - (qd - h * qdd)).tolist()
        request.current_acceleration = (present[2] - qdd).tolist()
        # Do not overtake the signal, even if it brakes with the limit.
        closing = (np.abs(q - self.q) + self.NEAR) * limits.acceleration / np.maximum(np.abs(qd), 1e-9)
        request.max_velocity = np.minimum(limits.velocity - qd, closing).tolist()
        request.min_velocity = np.maximum(-limits.velocity - qd, -closing).tolist()
        request.max_acceleration = (limit - qdd).tolist()
        request.min_acceleration = (-limit - qdd).tolist()
        relative = _after_a_tick(self._catcher, request)
        if relative is None:  # catching up would take more than 7600 s
            return self._change_to(np.zeros_like(q), limit)
        return np.stack((q, qd, qdd)) + relative

    def _change_to(self, qd: Floats, limit: float) -> Floats:
        """Return the state (3, n) a tick later on the shortest way to a velocity."""
        request, h = self._brake_request, PERIOD
        present = self.state
        request.current_position, request.current_velocity = present[0].tolist(), present[1].tolist()
        request.current_acceleration = present[2].tolist()
        request.target_velocity, request.max_acceleration = qd.tolist(), [limit] * len(qd)
        if (state := _after_a_tick(self._brake, request)) is None:
            q, qd, qdd = present
            state = np.stack((q + h * (qd + 0.5 * h * qdd), qd + h * qdd, qdd))
        return state


def _after_a_tick(generator: ruckig.Ruckig, request: ruckig.InputParameter) -> Floats | None:
    """Return the state (3, n) a tick later; None if ruckig finds no trajectory."""
    result = ruckig.OutputParameter(request.degrees_of_freedom)
    generator.reset()  # otherwise ruckig would continue an old trajectory if its state happens to recur
    try:
        if generator.update(request, result) < 0:
            return None
    except (ruckig.RuckigError, ValueError):
        return None
    return np.array((result.new_position, result.new_velocity, result.new_acceleration))
