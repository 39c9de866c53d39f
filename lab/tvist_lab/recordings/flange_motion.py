"""Compute the rotation and specific force that a sensor at the flange would measure, from logged joint angles."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tvist_controller.api.planning import Arm
from tvist_lab.recordings.recording import Floats, RecordingError
from tvist_plant.description import RobotDescription

RATE = 100.0  # rate of the compared rows [Hz], some ten times the bandwidth after smoothing
SMOOTHING = {False: 0.02, True: 0.06}
"""Standard deviation of the smoothing of rotation and force [s]: joint angles hardly show vibration, which
dominates the force at 10 Hz, while a gyroscope's bias wanders slowly."""
GRAVITY = np.array([0.0, 0.0, 9.80665])
AT_REST = 0.2  # share of a log in which the arm is assumed to rest [-]
SPARSE = 10.0  # duration of a log relative to that of its rows from which it is mostly gaps [-]
HELD = 0.05
"""Longest time for which a log repeats angles between two measurements [s]; if longer, the arm rests."""


@dataclass(frozen=True)
class Felt:
    """A vector over time, in axes that move with it."""

    time: Floats  # times on its own clock, spaced by 1/`RATE`, shape (T,) [s]
    vector: Floats  # angular velocity [rad/s] or specific force [m/s²], smoothed, shape (T, 3)
    lever: Floats
    """Change per unit of distance along x, y, z from the flange, shape (T, 3, k); k is 0 for a rotation."""
    known: Floats  # 1 where there were rows, 0 in a gap, shape (T,)

    @property
    def change(self) -> Floats:
        """Activity beyond that at rest, in any axes: |ω|, or |df/dt| of a force, shape (T,)."""
        force = self.lever.shape[2]
        felt = np.linalg.norm(np.gradient(self.vector, 1.0 / RATE, axis=0) if force else self.vector, axis=1)
        more: Floats = np.maximum(felt - np.quantile(felt, AT_REST), 0.0)
        return more


def by_sensor(time: Floats, vector: Floats, *, force: bool) -> Felt:
    """Resample a sensor's angular velocity [rad/s] or specific force [m/s²], shape (T, 3), in its own axes."""
    grid, values, known = _resampled(time, vector)
    return _smoothed(grid, values, known, np.zeros((len(grid), 3, 3 if force else 0)))


def at_flange(robot: RobotDescription, time: Floats, q: Floats, *, force: bool) -> Felt:
    """Return what a sensor at the flange would measure, by forward kinematics.

    ω = Rᵀ J_ω q̇, and f = Rᵀ (p̈ + g z) with an upright base. A sensor at r from the flange measures f + α x r + ω x
    (ω x r). `time` [s] has shape (T,), `q` [rad] (T, n); for the rotation only the directions of the joints matter.
    """
    grid, angles, known = _resampled(*_measured(time, q))
    step = grid[1] - grid[0]
    arm = Arm(robot)
    rotation, position, jacobian = map(np.array, zip(*(arm.located(row) for row in angles), strict=True))
    speeds = np.gradient(angles, step, axis=0)
    omega = np.einsum("tji,tjk,tk->ti", rotation, jacobian[:, 3:], speeds)
    if not force:
        return _smoothed(grid, omega, known, np.zeros((len(grid), 3, 0)))
    pull = np.gradient(np.gradient(position, step, axis=0), step, axis=0) + GRAVITY
    turning = _crossing(omega)
    lever = _crossing(np.gradient(omega, step, axis=0)) + turning @ turning
    return _smoothed(grid, np.einsum("tji,tj->ti", rotation, pull), known, lever)


def _measured(time: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Drop rows that repeat the angles before, as in a log faster than its robot, since they are late."""
    moves = np.append([True], np.any(np.diff(q, axis=0) != 0.0, axis=1))
    next_move = np.append(time[moves], [np.inf])[np.cumsum(moves)]
    last_move = time[moves][np.cumsum(moves) - 1]
    kept = moves | ((next_move - last_move > HELD) & (next_move - time > 0.5 * HELD))
    return time[kept], q[kept]


def _resampled(time: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Resample rows at `RATE` or a multiple: return times, interpolated values, and 1, or 0 in a gap of the log."""
    seen = np.isfinite(values).all(axis=1)
    time, values = time[seen], values[seen]
    if len(time) < 2 or not 1.0 < time[-1] - time[0] < SPARSE * len(time) * float(np.median(np.diff(time))):
        raise RecordingError(
            f"{len(time)} rows with numbers cannot be joined: there must be a second of them, without long gaps"
        )
    step = np.diff(time)
    rate = RATE * max(1, round(1.0 / (RATE * float(np.median(step)))))
    grid = time[0] + np.arange(int((time[-1] - time[0]) * rate) + 1) / rate
    place = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(step) - 1)
    known = (step[place] <= max(3.0 * float(np.median(step)), HELD)).astype(np.float64)
    return grid, np.column_stack([np.interp(grid, time, axis) for axis in values.T]), known


def _smoothed(grid: Floats, values: Floats, known: Floats, lever: Floats) -> Felt:
    """Smooth equally spaced rows and reduce them to `RATE`."""
    every = round(1.0 / (RATE * (grid[1] - grid[0])))
    width = SMOOTHING[bool(lever.shape[2])] * RATE * every
    smooth, arms = (gaussian_filter1d(one, width, axis=0)[::every] for one in (values, lever))
    return Felt(grid[::every], smooth, arms, known[::every])


def _crossing(vector: Floats) -> Floats:
    """Return matrices [v]x, shape (T, 3, 3)."""
    return np.stack([np.cross(vector, axis) for axis in np.eye(3)], axis=2)
