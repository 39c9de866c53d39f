"""The joint positions that a trajectory controller wants, tick by tick."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np

from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD

WayName = Literal["ramp", "turn", "jump"]

APPROACH = 6.0
"""Time in which the trajectory of the driver's test reaches its first point [s]."""
DISTANCE = 1.0
"""Distance of every joint from there to its last point [rad]."""
RAMP = 4.0
"""Acceleration of a ramp [rad/s^2]."""
CONSTANT = 0.5
"""Time at constant speed between two ramps [s]."""
REST = 0.5
"""Time at rest after the end [s], in which every shaper comes to rest."""


def jump(start: Floats, speed: float) -> Floats:
    """Trajectory of the ROS 2 driver's test `test_trajectory_scaled`, at any speed.

    It is linear between its points, as `joint_trajectory_controller` interpolates positions: in 6 s to all joints at 0,
    then to all joints at -1 rad. So the velocity jumps where the fast part begins and ends. The test has 0.5 s for
    that part, which is 2 rad/s.

    Args:
        start: Joint positions at rest, shape (n,) [rad].
        speed: Speed of every joint in the fast part [rad/s].

    Returns:
        Wanted positions, one for each tick, the first at the start, shape (T, n) [rad].
    """
    points = (0.0, APPROACH, APPROACH + DISTANCE / speed)
    t = _ticks(points[-1])
    return np.column_stack([np.interp(t, points, (q, 0.0, -DISTANCE)) for q in start])


def turn(start: Floats, speed: float) -> Floats:
    """The fast part of that test from where the arm is at the start: every joint by 1 rad at once, at constant speed.

    Args:
        start: Joint positions at rest, shape (n,) [rad].
        speed: Speed of every joint [rad/s].

    Returns:
        Wanted positions, one for each tick, the first at the start, shape (T, n) [rad].
    """
    duration = DISTANCE / speed
    return start + DISTANCE * np.clip(_ticks(duration) / duration, 0.0, 1.0)[:, np.newaxis]


def ramp(start: Floats, speed: float) -> Floats:
    """Trajectory of the first joint alone: speed up with 4 rad/s², 0.5 s at constant speed, and slow down likewise.

    Args:
        start: Joint positions at rest, shape (n,) [rad].
        speed: Constant speed [rad/s].

    Returns:
        Wanted positions, one for each tick, the first at the start, shape (T, n) [rad].
    """
    rise = speed / RAMP
    t = _ticks(2.0 * rise + CONSTANT)
    up, level = np.clip(t, 0.0, rise), np.clip(t - rise, 0.0, CONSTANT)
    down = np.clip(t - rise - CONSTANT, 0.0, rise)
    wanted = np.tile(start, (len(t), 1))
    wanted[:, 0] += 0.5 * RAMP * (up**2 - down**2) + speed * (level + down)
    return wanted


def level_end(speed: float) -> int:
    """Return the last tick at which a ramp is at constant speed."""
    return int((speed / RAMP + CONSTANT) / PERIOD + 1e-9)


WAYS: Mapping[WayName, Callable[[Floats, float], Floats]] = MappingProxyType(
    {"ramp": ramp, "turn": turn, "jump": jump}
)
"""The trajectories by name."""


def _ticks(duration: float) -> Floats:
    """Times of the ticks of a trajectory and of the rest after it, shape (T,) [s]."""
    return PERIOD * np.arange(round((duration + REST) / PERIOD) + 1, dtype=np.float64)
