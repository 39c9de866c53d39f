"""Signals of a robot over time, for plots: the newest are kept, the oldest are forgotten."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_protocol.stream import State, Truth
from tvist_view.chain import Floats

GRAVITY = 9.81
"""Gravity of the simulated world [m/s²]."""
RESTS = 1e-9
"""Change of a reference within a tick that counts as none [rad]."""


@dataclass(frozen=True)
class Signals:
    """Samples in the order of time; T of them."""

    time: Floats
    """Simulation time, shape (T,) [s]."""
    alpha: Floats
    """|α|, acceleration of the tool without gravity, shape (T,) [m/s²].

    Free of noise if the robot tells the truth, and then NaN at a tick whose truth is missing; else measured.
    """
    acceleration: Floats
    """Largest |q̈| over the joints of the shaped reference, shape (T,) [rad/s²]."""
    unshaped: Floats
    """The same of the reference before the shaper, shape (T,) [rad/s²]."""
    f_d: Floats
    """Damped frequency of the lowest mode, as estimated, shape (T,) [Hz]."""
    zeta: Floats
    """Damping ratio of the lowest mode, as estimated, shape (T,) [-]."""
    delay: Floats
    """Mean delay of the shaper, shape (T,) [s]."""

    def largest_alpha(self) -> float:
        """Largest |α| that is known, 0 without any [m/s²]."""
        return float(np.nan_to_num(self.alpha).max(initial=0.0))

    def between(self, start: float, end: float) -> "Signals":
        """The samples of a span of time, both ends included."""
        first, last = np.searchsorted(self.time, (start, end + 1e-9))
        return Signals(**{name: values[first:last] for name, values in vars(self).items()})


class History:
    """The newest signals of one robot.

    Args:
        twists: Denavit-Hartenberg twists of the arm, one per joint [rad].
        samples: Number of samples kept.
    """

    def __init__(self, twists: Sequence[float], samples: int) -> None:
        self._twists, self._joints = tuple(twists), len(twists)
        joints = self._joints
        self._rows = np.full((samples, 7 + 3 * joints), np.nan)
        self._truths = np.full((samples, 7), np.nan)
        self._count = self._truth_count = 0

    def add(self, state: State) -> None:
        """Keep a state; one whose time is not later than the last one's is the same, told again."""
        if self._count and state.timestamp <= self._rows[(self._count - 1) % len(self._rows), 0]:
            if state.timestamp == self._rows[(self._count - 1) % len(self._rows), 0]:
                return
            self.clear()  # a robot that has started anew
        self._rows[self._count % len(self._rows)] = (
            state.timestamp,
            *state.actual_tool_accelerometer,
            state.estimated_f_d[0] if state.estimated_f_d else np.nan,
            state.estimated_zeta[0] if state.estimated_zeta else np.nan,
            state.shaper_delay,
            *state.target_qdd,
            *state.reference_q,
            *state.actual_q,
        )
        self._count += 1

    def add_truth(self, truth: Truth) -> None:
        """Keep the true acceleration, which has no noise."""
        self._truths[self._truth_count % len(self._truths)] = (
            truth.timestamp,
            *truth.tool_acceleration,
            *truth.flange_pose[3:],
        )
        self._truth_count += 1

    def clear(self) -> None:
        """Forget everything."""
        self._count = self._truth_count = 0

    def signals(self) -> Signals:
        """Everything that is kept."""
        rows = _in_order(self._rows, self._count)
        time, n = rows[:, 0], self._joints
        alpha = _length(rows[:, 1:4] - GRAVITY * up_in_flange(rows[:, 7 + 2 * n : 7 + 3 * n], self._twists))
        truths = _in_order(self._truths, self._truth_count)
        if len(truths):
            place = np.clip(np.searchsorted(truths[:, 0], time), 0, len(truths) - 1)
            same = np.abs(truths[place, 0] - time) < 1e-9
            true = _length(truths[:, 1:4] - GRAVITY * _up(truths[:, 4:7]))
            alpha = np.where(same, true[place], np.nan)  # the sensor's noise would look like vibration
        return Signals(
            time=time,
            alpha=alpha,
            acceleration=np.abs(rows[:, 7 : 7 + n]).max(axis=1, initial=0.0),
            unshaped=_second_difference(time, rows[:, 7 + n : 7 + 2 * n]),
            f_d=rows[:, 4],
            zeta=rows[:, 5],
            delay=rows[:, 6],
        )


def rests_since(signals: Signals) -> tuple[float, float] | None:
    """Times at which the reference and the shaped reference of the last motion came to rest [s]; None: not yet."""
    moving = np.flatnonzero(signals.unshaped > RESTS / 0.002**2)
    shaped = np.flatnonzero(signals.acceleration > RESTS / 0.002**2)
    if not len(moving) or not len(shaped) or shaped[-1] >= len(signals.time) - 2:
        return None
    return float(signals.time[moving[-1]]), float(signals.time[shaped[-1]])


def _in_order(ring: Floats, count: int) -> Floats:
    """The rows of a ring buffer, oldest first."""
    if count <= len(ring):
        return ring[:count]
    return np.roll(ring, -(count % len(ring)), axis=0)


def up_in_flange(q: Floats, twists: Sequence[float]) -> Floats:
    """The upward direction in the frame of the flange, shape (T, 3).

    Args:
        q: Joint angles, shape (T, joints) [rad].
        twists: Denavit-Hartenberg twists, one per joint [rad].
    """
    up = np.tile([0.0, 0.0, 1.0], (len(q), 1))
    for angle, twist in zip(q.T, twists, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        x, y, z = c * up[:, 0] + s * up[:, 1], c * up[:, 1] - s * up[:, 0], up[:, 2]
        c, s = np.cos(twist), np.sin(twist)
        up = np.stack([x, c * y + s * z, c * z - s * y], axis=1)
    return up


def _up(rotation: Floats) -> Floats:
    """The upward direction in frames with rotation vectors, both of shape (T, 3)."""
    angle = np.linalg.norm(rotation, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axis = np.where(angle[:, None] > 0.0, rotation / angle[:, None], 0.0)
    up = np.array([0.0, 0.0, 1.0])
    # Rodrigues' formula for the rotation by -angle.
    return np.asarray(
        np.cos(angle)[:, None] * up
        - np.sin(angle)[:, None] * np.cross(axis, up)
        + ((1.0 - np.cos(angle)) * (axis @ up))[:, None] * axis
    )


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _second_difference(time: Floats, q: Floats) -> Floats:
    """Largest |q̈| over the joints, by central differences; zero at both ends and over holes."""
    out = np.zeros(len(time))
    if len(time) > 2:
        step = np.diff(time)
        even = (np.abs(np.diff(step)) < 1e-6) & (step[1:] > 0.0)
        change = np.abs(np.diff(q, 2, axis=0)).max(axis=1, initial=0.0)
        out[1:-1] = np.where(even, change / np.maximum(step[1:], 1e-9) ** 2, 0.0)
    return out
