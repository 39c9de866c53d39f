"""Find offset and drift between the clocks of a robot and a sensor at its flange from a motion both measured.

What a sensor at the flange would measure is computed from the logged joint angles; the real sensor's axes may
be rotated in any way. The motion is first located by its magnitude, which no rotation changes, at any offset
and with drifts of up to 2 %. Then offset, drift, rotation (at first from a singular value decomposition that
solves Wahba's problem: Markley 1988), bias and lever are fitted together to the vectors.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import correlate, find_peaks
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from tvist_controller.api.line import Arm
from tvist_lab.recordings.recording import Floats, RecordingError
from tvist_plant.description import RobotDescription

RATE = 100.0  # rate of the compared rows [Hz], some ten times the bandwidth after smoothing
SMOOTHING = {False: 0.02, True: 0.06}
"""Standard deviation of the smoothing of rotation and force [s]: joint angles hardly show vibration, which
dominates the force at 10 Hz, while a gyroscope's bias wanders slowly."""
GRAVITY = np.array([0.0, 0.0, 9.80665])
AT_REST = 0.2  # share of a log in which the arm is assumed to rest [-]
SPARSE = 10.0  # if a log lasts longer than its rows by this factor, it is refused as mostly gaps [-]
HELD = 0.05  # longest time between two measurements of an arm that moves [s]
DRIFT = 0.02  # largest drift in the search [-]
COARSE = 5  # reduction of rows for the search: one of this number is used
BLURRED = 0.2  # largest time error at the ends of a log due to the search's steps of drift [s]
TRIED = 24  # number of candidates that are fitted
APART = 0.25  # difference from which offsets are distinct [s]; the step of a fit is at most half of it
BLOCK = 0.5  # time after which residuals of a fit count as independent [s]
HUBER = 2.0  # residuals beyond this multiple of the median have less weight (Huber 1964)
RANK = 1e-9  # share of the largest eigenvalue below which parameters cannot be separated [-]
MOVING = 1e-3  # smallest weight of an informative block, relative to the largest [-]
ITERATIONS = 15
CONVERGED = 1e-5  # change of the offset anywhere in a log at which a fit ends [s]
TURN, BIAS, LEVER = slice(2, 5), slice(5, 8), slice(8, None)
"""Positions among the parameters of a fit, after offset and drift."""


@dataclass(frozen=True)
class BodyFrameSignal:
    """A vector over time, in the axes of the moving body."""

    time: Floats  # times on its own clock, spaced by 1/`RATE`, shape (T,) [s]
    vector: Floats  # angular velocity [rad/s] or specific force [m/s²], smoothed, shape (T, 3)
    lever: Floats
    """Change per unit of distance along x, y, z from the flange, shape (T, 3, k); k is 0 for a rotation."""
    known: Floats  # 1 where there were rows, 0 in a gap, shape (T,)

    @property
    def change(self) -> Floats:
        """Magnitude of motion beyond noise at rest, equal in any axes: |ω|, or |df/dt| of a force, (T,)."""
        force = self.lever.shape[2]
        felt = np.linalg.norm(np.gradient(self.vector, 1.0 / RATE, axis=0) if force else self.vector, axis=1)
        more: Floats = np.maximum(felt - np.quantile(felt, AT_REST), 0.0)
        return more


def by_sensor(time: Floats, vector: Floats, *, force: bool) -> BodyFrameSignal:
    """Resample a sensor's angular velocity [rad/s] or specific force [m/s²], shape (T, 3), in its own axes."""
    grid, values, known = _resampled(time, vector)
    return _smoothed(grid, values, known, np.zeros((len(grid), 3, 3 if force else 0)))


def at_flange(robot: RobotDescription, time: Floats, q: Floats, *, force: bool) -> BodyFrameSignal:
    """Return what a sensor at the flange would measure, by forward kinematics.

    ω = Rᵀ J_ω q̇, and f = Rᵀ (p̈ + g z) with an upright base. A sensor at r from the flange measures f + α x r + ω x
    (ω x r). `time` [s] has shape (T,), `q` [rad] (T, n); for the rotation only the directions of the joints matter.
    """
    grid, angles, known = _resampled(*_measured(time, q))
    step = grid[1] - grid[0]
    arm = Arm(robot)
    rotation, position, jacobian = map(np.array, zip(*(arm.located(row) for row in angles), strict=True))
    omega = np.einsum("tji,tjk,tk->ti", rotation, jacobian[:, 3:], np.gradient(angles, step, axis=0))
    if not force:
        return _smoothed(grid, omega, known, np.zeros((len(grid), 3, 0)))
    pull = np.gradient(np.gradient(position, step, axis=0), step, axis=0) + GRAVITY
    turning = _crossing(omega)
    lever = _crossing(np.gradient(omega, step, axis=0)) + turning @ turning
    return _smoothed(grid, np.einsum("tji,tj->ti", rotation, pull), known, lever)


def _measured(time: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Drop rows that only repeat angles, as in a log faster than its robot: these angles are out of date."""
    moves = np.append([True], np.any(np.diff(q, axis=0) != 0.0, axis=1))
    next_move = np.append(time[moves], [np.inf])[np.cumsum(moves)]
    last_move = time[moves][np.cumsum(moves) - 1]
    kept = moves | ((next_move - last_move > HELD) & (next_move - time > 0.5 * HELD))
    return time[kept], q[kept]


def _resampled(time: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Resample rows at `RATE` or a multiple: return times, interpolated values, and 0 for gaps, else 1."""
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


def _smoothed(grid: Floats, values: Floats, known: Floats, lever: Floats) -> BodyFrameSignal:
    """Smooth equally spaced rows and reduce them to `RATE`."""
    every = round(1.0 / (RATE * (grid[1] - grid[0])))
    width = SMOOTHING[bool(lever.shape[2])] * RATE * every
    smooth, arms = (gaussian_filter1d(one, width, axis=0)[::every] for one in (values, lever))
    return BodyFrameSignal(grid[::every], smooth, arms, known[::every])


def _crossing(vector: Floats) -> Floats:
    """Return matrices [v]x, shape (T, 3, 3)."""
    return np.stack([np.cross(vector, axis) for axis in np.eye(3)], axis=2)


@dataclass(frozen=True)
class Clocks:
    """The other clock shows `other + (1 + drift) (t - middle)` when the first one shows t."""

    middle: float  # middle of the common time, on the first clock [s]
    other: float  # time of the other clock then [s]
    drift: float  # relative speed of the other clock, minus 1 [-]
    half: tuple[float, float]  # half of the 95 % intervals of the offset [s] and the drift [-]
    correlation: float  # correlation of the vectors after rotation [-]
    scale: float  # size of the first vector relative to the other [-]
    explained: float  # part of the energy of the first vector's changes that the other vector explains
    span: tuple[float, float]  # first and last common time, on the first clock [s]

    def first(self, other: Floats) -> Floats:
        """Return times of the first clock for those of the other one."""
        return self.middle + (other - self.other) / (1.0 + self.drift)

    def offset(self, time: float) -> float:
        """Return how far the other clock is ahead, at a time of the first [s]."""
        return self.other - self.middle + self.drift * (time - self.middle)


def fits(first: BodyFrameSignal, other: BodyFrameSignal) -> list[Clocks]:
    """Return the possible alignments of two signals; the alignment that explains most comes first."""
    found: list[Clocks] = []
    for start, drift in _places(first, other):
        clocks = _fitted(first, other, start, drift)
        if clocks is not None and all(
            abs(clocks.offset(one.middle) - one.offset(one.middle)) > APART for one in found
        ):
            found.append(clocks)
    return sorted(found, key=lambda clocks: -clocks.explained)


def _places(first: BodyFrameSignal, other: BodyFrameSignal) -> Iterator[tuple[float, float]]:
    """Yield candidates at which both signals move simultaneously: other clock at the first row, and drift."""
    length, rows = first.time[-1] - first.time[0], COARSE / RATE
    moved, moved_there = first.change[::COARSE], other.change
    count = int(np.ceil(DRIFT * length / BLURRED))
    found: list[tuple[float, float, float]] = []
    for drift in np.linspace(-DRIFT, DRIFT, 2 * count + 1).tolist():
        step = rows * (1.0 + drift)
        there = np.interp(np.arange(other.time[0], other.time[-1], step), other.time, moved_there)
        alike = np.pad(correlate(there, moved, "full", "fft"), 1)
        peaks = find_peaks(alike, distance=max(1, round(APART / rows)))[0]
        found += [(float(alike[at]), float(other.time[0] + (at - len(moved)) * step), drift) for at in peaks]
    taken: list[float] = []
    for _, start, drift in sorted(found, reverse=True):
        middle = start + 0.5 * (1.0 + drift) * length
        if len(taken) < TRIED and all(abs(middle - one) > APART for one in taken):
            taken.append(middle)
            yield start, drift


def _fitted(first: BodyFrameSignal, other: BodyFrameSignal, start: float, drift: float) -> Clocks | None:
    """Fit all parameters from a starting point by Gauss-Newton; None if the fit leaves the common time."""
    # Use the derivative of the first signal: joint angles have little ringing and noise.
    rate = np.gradient(first.vector, 1.0 / RATE, axis=0)
    t, rotation, weight = first.time - first.time[0], None, np.ones(len(first.time))
    for _ in range(ITERATIONS):
        then = start + (1.0 + drift) * t
        both = (first.known > 0.0) & (np.interp(then, other.time, other.known, 0.0, 0.0) == 1.0)
        if np.count_nonzero(both) < RATE or abs(drift) > 1.5 * DRIFT:
            return None
        middle = float(t[both].mean())
        w, moved, since = first.vector[both], rate[both], t[both] - middle
        u = np.column_stack([np.interp(then[both], other.time, axis) for axis in other.vector.T])
        if rotation is None:
            rotation = Rotation.from_matrix(closest_rotation((w - w.mean(0)).T @ (u - u.mean(0))))
        u = rotation.apply(u)
        X = np.concatenate(
            [np.stack([moved, moved * since[:, None]], axis=2), -_crossing(u),
             np.broadcast_to(np.eye(3), (len(w), 3, 3)), -first.lever[both]], axis=2,
        )  # fmt: skip
        p, left = _solved(X, w - u, weight[both])
        far = np.linalg.norm(left, axis=1)
        weight[both] = np.minimum(1.0, HUBER * float(np.median(far)) / np.maximum(far, 1e-12))
        step = p[:2] * min(1.0, 0.5 * APART / max(abs(p[0]), CONVERGED))
        start, drift = start + step[0] - step[1] * middle, drift + step[1]
        rotation = Rotation.from_rotvec(p[TURN]) * rotation
        if abs(step[0]) + abs(step[1]) * since[-1] < CONVERGED:
            break
    w = w - X[:, :, LEVER] @ p[LEVER]
    around, around_u = w - w.mean(0), u - u.mean(0)
    energy, lost = float(np.square(around).sum()), float(np.square(left).sum())
    return Clocks(
        middle=float(first.time[0] + middle),
        other=float(start + (1.0 + drift) * middle),
        drift=float(drift),
        half=_intervals(X, left, weight[both], since),
        correlation=float(np.sqrt(max(0.0, 1.0 - lost / max(energy, 1e-30)))),
        scale=float(np.sum(around * around_u) / max(np.square(around_u).sum(), 1e-30)),
        explained=max(0.0, energy - lost) / RATE,
        span=(float(first.time[both][0]), float(first.time[both][-1])),
    )


def closest_rotation(products: Floats) -> Floats:
    """Return the R that minimizes Σ |a_i - R b_i|², shape (3, 3); `products` is Σ a_i b_iᵀ."""
    # Kabsch, Acta Crystallographica A32, 1976.
    left, _, right = np.linalg.svd(products)
    return np.asarray(left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right)


def _solved(X: Floats, y: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Solve weighted least squares; return parameters, and residuals of shape (T, 3)."""
    # If all motion turns about one axis, the rotation about it is not observable and is not changed.
    G, g = (np.einsum("tik,t,ti...->k...", X, weight, one, optimize=True) for one in (X, y))
    p: Floats = _inverse(G, G) @ g
    return p, y - X @ p


def _inverse(G: Floats, whole: Floats) -> Floats:
    """Return the pseudo-inverse of one or several matrices, with parameters scaled by the diagonal of `whole`."""
    size = np.sqrt(np.maximum(np.diag(whole), 1e-24))
    scale = np.outer(size, size)
    inverse: Floats = np.linalg.pinv(G / scale, RANK, hermitian=True) / scale
    return inverse


def _intervals(X: Floats, left: Floats, weight: Floats, since: Floats) -> tuple[float, float]:
    """Return half the 95 % intervals of the offset, at the log's end where it is wider, and of the drift.

    Since residuals are correlated in time and few fast motions have most weight, the fit is repeated, to
    first order, without each block of `BLOCK` (the jackknife of Tukey 1958, with Student's quantile for the
    blocks with motion).
    """
    first = np.unique(np.searchsorted(since, np.arange(since[0], since[-1], BLOCK)))
    pulls = np.add.reduceat(np.einsum("tik,t,ti->tk", X, weight, left), first)
    grams = np.add.reduceat(np.einsum("tik,t,til->tkl", X, weight, X), first)
    without = _inverse(grams.sum(axis=0) - grams, grams.sum(axis=0))
    moved = np.einsum("bkl,bl->bk", without, pulls)[:, :2]
    at_start, at_end, drift = (moved @ np.array(of) for of in ((1.0, since[0]), (1.0, since[-1]), (0.0, 1.0)))
    offset, rate = max(np.linalg.norm(at_start), np.linalg.norm(at_end)), np.linalg.norm(drift)
    moving = np.count_nonzero(grams[:, 0, 0] > MOVING * grams[:, 0, 0].max())
    quantile = float(student.ppf(0.975, max(1, moving - 2)))
    return quantile * float(offset), quantile * float(rate)
