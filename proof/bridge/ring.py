"""How much a robot's tool rings after each stop of a program, by the robot's own recording."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_lab.metrics.vibration import best_tool_acceleration
from tvist_lab.recordings import Floats, Recording

FAST, QUICK = 0.01, 0.02
"""The target moves above this velocity [rad/s] or acceleration [rad/s²]: a set-point that is followed with a lag is
approached ever more slowly, and what is left then shakes no tool.
"""
REST_S = 0.06
"""Shortest rest that parts two motions [s]."""
FAR = 0.05
"""Way of a joint below which nothing is a motion of a program [rad]."""
CLOSE = 0.01
"""Two motions that end nearer to each other than this are one [rad]."""
WINDOW_S = 0.3
"""Time after a stop in which the tool is looked at, if the next motion does not begin before [s]."""


@dataclass(frozen=True)
class Stop:
    """A stop of the robot's target."""

    q: Floats
    """Where it stopped, shape (n,) [rad]."""
    window_s: float
    """Time in which the tool may be looked at [s]."""
    alpha: Floats
    """α from the stop on, shape (T, 3) [m/s²]."""
    period: float
    """Time between two of them [s]."""

    def ring(self, within: float, noise: float) -> float:
        """Return the rms of |α| within some time after the stop, without the sensor's noise [m/s²]."""
        square = float((self.alpha[: max(round(within / self.period), 1)] ** 2).sum(axis=1).mean())
        return math.sqrt(max(square - noise**2, 0.0))


def noise_of(recording: Recording, before: int) -> float:
    """Return the rms of the sensor's noise, while the robot rests before a tick [m/s²]."""
    alpha = best_tool_acceleration(recording)[: np.searchsorted(recording["tick"], before)]
    return math.sqrt(float(alpha.var(axis=0).sum()))


def stops(recording: Recording, ticks: tuple[int, int]) -> list[Stop]:
    """Find where the target of a robot that shapes nothing comes to rest between two ticks.

    Args:
        recording: The robot's recording.
        ticks: First and last tick of a program.
    """
    first, past = np.searchsorted(recording["tick"], ticks)
    rows = slice(int(first), int(past))
    velocity, acceleration = (
        np.abs(recording[name][rows]).max(axis=1) for name in ("target_qd", "target_qdd")
    )
    moving = np.flatnonzero((velocity > FAST) | (acceleration > QUICK))
    if not moving.size:
        return []
    q, time = recording["target_q"][rows], recording.time[rows]
    alpha = best_tool_acceleration(recording)[rows]
    runs = np.split(moving, np.flatnonzero(np.diff(time[moving]) > REST_S) + 1)
    ends = [*(int(run[0]) for run in runs[1:]), len(time)]
    found = []
    for run, end in zip(runs, ends, strict=True):
        stop = int(run[-1]) + 1
        if np.ptp(q[run[0] : stop], axis=0).max(initial=0.0) > FAR and end > stop + 1:
            rest = float(time[end - 1] - time[stop])
            # What gravity does to a tilted sensor is known from the end of the rest, if that is long enough.
            still = alpha[(stop + end) // 2 : end].mean(axis=0) if rest > 2.0 * WINDOW_S else 0.0
            found.append(Stop(q[stop], min(rest, WINDOW_S), alpha[stop:end] - still, recording.period))
    return found


def compared(direct: Sequence[Stop], other: Sequence[Stop], noise: float) -> list[tuple[float, float]]:
    """Compare the stops that two runs of a program have in common: where one rests shortly, the other may not at all.

    Args:
        direct: Stops of the robot itself.
        other: Stops with something between program and robot.
        noise: Rms of the sensor's noise [m/s²].

    Returns:
        The ring of each in either run [m/s²], over windows of equal length.
    """
    found, place = [], 0
    for stop in other:
        at = next((i for i in range(place, len(direct)) if apart(direct[i], stop) < CLOSE), None)
        if at is not None:
            place = at + 1
            window = min(direct[at].window_s, stop.window_s)
            found.append((direct[at].ring(window, noise), stop.ring(window, noise)))
    return found


def apart(one: Stop, other: Stop) -> float:
    """Return the largest difference of the angles at which two motions stopped [rad]."""
    return float(np.abs(one.q - other.q).max())
