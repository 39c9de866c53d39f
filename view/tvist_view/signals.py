"""Signals of a robot over time, for plots."""

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tvist_plant.tool_acceleration import tool_acceleration, upward
from tvist_protocol.stream import State, Truth
from tvist_view.look import Floats, Look

RESTS = 1e-9  # change of a reference within a tick that counts as rest [rad]
MOVING = 1e-3  # acceleration above which a reference counts as moving, in a recorded motion [rad/s²]
BRAKES_S = 0.02  # time after the stop of the shaped reference during which the tool still decelerates [s]
KEPT = 3000  # samples of a running robot that are kept: six seconds
LATE_TICKS = 50  # ticks after which a missing truth is no longer awaited


@dataclass(frozen=True)
class Signals:
    """T samples in the order of time."""

    time: Floats  # simulation time, shape (T,) [s]
    alpha: Floats
    """|α|, acceleration of the tool without gravity, shape (T,) [m/s²].

    If the robot publishes the truth, it is free of noise, and NaN at ticks whose truth is missing; else it is
    measured.
    """
    acceleration: Floats  # largest |q̈| over the joints of the shaped reference, shape (T,) [rad/s²]
    unshaped: Floats  # the same for the reference before the shaper, shape (T,) [rad/s²]

    def largest_alpha(self) -> float:
        """Return the largest known |α|, 0 if none is known [m/s²]."""
        return float(np.nan_to_num(self.alpha).max(initial=0.0))

    def between(self, start: float, end: float) -> "Signals":
        """Return the samples of a span of time, both ends included."""
        first, last = np.searchsorted(self.time, (start, end + 1e-9))
        return Signals(**{name: values[first:last] for name, values in vars(self).items()})


def signals_of(look: Look, states: Sequence[State], truths: Mapping[int, Truth]) -> Signals:
    """Return the signals of states in the order of time.

    `truths` has the truths by tick; if it is empty, the tool's acceleration is the measured one.
    """
    time = np.array([state.timestamp for state in states])
    if truths:
        alpha = np.full(len(time), np.nan)  # the sensor's noise would look like vibration
        if known := {place: truths[one.tick] for place, one in enumerate(states) if one.tick in truths}:
            forces = np.array([truth.tool_acceleration for truth in known.values()])
            up = upward([truth.flange_pose[3:] for truth in known.values()])
            alpha[list(known)] = np.linalg.norm(tool_acceleration(forces, up), axis=1)
    else:
        measured = np.array([state.actual_tool_accelerometer for state in states]).reshape(-1, 3)
        angles = np.array([state.actual_q for state in states]).reshape(len(time), -1)
        alpha = np.linalg.norm(tool_acceleration(measured, up_in_flange(angles, look.turns)), axis=1)
    return Signals(
        time=time,
        alpha=alpha,
        acceleration=np.array([max(map(abs, state.target_qdd)) for state in states]),
        unshaped=_second_difference(time, np.array([state.reference_q for state in states])),
    )


class LatestSignals:
    """The latest signals and state of a running robot, whose states and truths arrive in any order."""

    def __init__(self, look: Look) -> None:
        self._look = look
        self._states: deque[State] = deque(maxlen=KEPT)
        self._truths: dict[int, Truth] = {}
        self.kept: deque[tuple[float, float, float, float]] = deque(maxlen=KEPT)
        self.count = 0  # number of samples since the start
        self.state: State | None = None
        self._shown: State | None = None

    @property
    def has_truth(self) -> bool:
        """Whether the robot publishes its truth."""
        return bool(self._truths)

    def add(self, message: State | Truth) -> None:
        """Keep a message; a tick earlier than the last one's means that the robot has restarted."""
        if isinstance(message, Truth):
            self._truths[message.tick] = message
            if len(self._truths) > 4 * LATE_TICKS:
                del self._truths[min(self._truths)]
            return
        last = -1 if self.state is None else self.state.tick
        if message.tick == last:
            return  # published again
        if message.tick < last:
            self._states.clear()
            self._truths.clear()
            self.kept.clear()
        self.state = message
        self._states.append(message)

    def row(self) -> list[float] | None:
        """Return the arm's position at the latest tick with known state and truth; None before the first."""
        shown = self._shown if self._shown is not None else self.state
        return None if shown is None else self._look.row(shown, self._truths.get(shown.tick))

    def update(self) -> None:
        """Compute the signals of the messages received."""
        states = list(self._states)
        if self._truths and self.state is not None:  # a state waits for its truth, and later states wait, too
            late = self.state.tick - LATE_TICKS
            states = [*itertools.takewhile(lambda one: one.tick in self._truths or one.tick < late, states)]
        if len(states) < 3:
            return
        found = signals_of(self._look, states, self._truths)
        # The first and the last sample have no second difference; other updates compute theirs.
        for sample in zip(*(values[1:-1].tolist() for values in vars(found).values()), strict=True):
            self.kept.append(sample)
            self.count += 1
        self._shown = states[-1]
        for _ in states[2:]:
            self._states.popleft()

    def since(self, count: int) -> list[list[float]]:
        """Return the samples after the first `count` as columns: time, |α|, |q̈| before and after the shaper."""
        new = min(self.count - count, len(self.kept))
        rows = list(self.kept)[len(self.kept) - new :]
        return [[round(row[place], 4) for row in rows] for place in (0, 1, 3, 2)]

    def signals(self) -> Signals:
        """Return all samples that are kept."""
        return Signals(*np.array(self.kept).reshape(-1, 4).T)


def moves(signals: Signals) -> tuple[float, float] | None:
    """Return the first and the last time at which the unshaped reference accelerates [s]; None if it does not."""
    moving = signals.time[signals.unshaped > MOVING]
    return (float(moving[0]), float(moving[-1])) if len(moving) else None


def rests_since(signals: Signals) -> tuple[float, float] | None:
    """Return when the last motion's reference and shaped reference came to rest [s]; None while they move."""
    moving = np.flatnonzero(signals.unshaped > RESTS / 0.002**2)
    shaped = np.flatnonzero(signals.acceleration > RESTS / 0.002**2)
    if not len(moving) or not len(shaped) or shaped[-1] >= len(signals.time) - 2:
        return None
    return float(signals.time[moving[-1]]), float(signals.time[shaped[-1]])


def after_stop(signals: Signals) -> str:
    """Describe the vibration after the last stop in words; empty if there is none yet."""
    rests = rests_since(signals)
    if rests is None:
        return ""
    rest = signals.between(rests[1] + BRAKES_S, signals.time[-1])
    later = 1e3 * (rests[1] - rests[0])
    return f"after the stop {rest.largest_alpha():.2f} m/s²; shaping made the motion {later:.0f} ms longer"


def up_in_flange(q: Floats, turns: Sequence[Floats]) -> Floats:
    """Return the upward direction in the flange's frame, shape (T, 3).

    `q` are joint angles, shape (T, joints) [rad]; `turns` are `Look.turns`.
    """
    up = np.tile([0.0, 0.0, 1.0], (len(q), 1))
    for angle, turn in zip(q.T, turns, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        up = np.stack([c * up[:, 0] + s * up[:, 1], c * up[:, 1] - s * up[:, 0], up[:, 2]], axis=1) @ turn
    return up


def _second_difference(time: Floats, q: Floats) -> Floats:
    """Largest |q̈| over the joints, by central differences; zero at both ends and at gaps."""
    out = np.zeros(len(time))
    if len(time) > 2:
        step = np.diff(time)
        even = (np.abs(np.diff(step)) < 1e-6) & (step[1:] > 0.0)
        change = np.abs(np.diff(q, 2, axis=0)).max(axis=1, initial=0.0)
        out[1:-1] = np.where(even, change / np.maximum(step[1:], 1e-9) ** 2, 0.0)
    return out
