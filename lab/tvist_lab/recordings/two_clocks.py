"""Offset and drift between the clocks of two devices, by what both felt of the same motion.

The axes of the two may be turned against each other in any way. A motion is first looked for by how much happens,
which no rotation changes, at any offset and at drifts of up to 2 %; then offset, drift, rotation (at first by Wahba's
problem, with a singular value decomposition: Markley 1988), bias and lever are fitted together to the vectors.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate, find_peaks
from scipy.spatial.transform import Rotation

from tvist_lab.recordings.flange_motion import RATE, Felt
from tvist_lab.recordings.recording import Floats

DRIFT = 0.02
"""Largest drift that is looked for [-]."""
COARSE = 5
"""One of so many rows counts in the search."""
BLURRED = 0.2
"""Time by which a drift may be wrong between the ends of a log in the search [s]."""
TRIED = 8
"""Number of places that are fitted."""
APART = 0.25
"""Offsets that differ by more are different ones, and a step of a fit is at most half of it [s]."""
BLOCK = 0.5
"""Time after which what a fit leaves counts as new [s]."""
ITERATIONS = 30
CONVERGED = 1e-6
"""Change of the offset, anywhere in a log, with which a fit ends [s]."""
TURN, BIAS, LEVER = slice(2, 5), slice(5, 8), slice(8, None)
"""Places among the parameters of a fit, after offset and drift."""


@dataclass(frozen=True)
class Clocks:
    """The other clock shows `other + (1 + drift) (t - middle)` when the first one shows t."""

    middle: float
    """Middle of what both felt, on the first clock [s]."""
    other: float
    """The other clock then [s]."""
    drift: float
    """By how much the other clock runs faster [-]."""
    half: tuple[float, float]
    """Half of the 95 % interval of the offset, at the end where it is wider [s], and of the drift [-]."""
    correlation: float
    """Of the vectors, once turned [-]."""
    scale: float
    """Size of the first vector over that of the other [-]."""
    explained: float
    """Energy of the first vector's changes that the other explains [its unit squared times s]."""
    span: tuple[float, float]
    """First and last time of what both felt, on the first clock [s]."""

    def first(self, other: Floats) -> Floats:
        """Return times of the first clock for those of the other one."""
        return self.middle + (other - self.other) / (1.0 + self.drift)

    def offset(self, time: float) -> float:
        """By how much the other clock shows more than the first one, at a time of the first [s]."""
        return self.other - self.middle + self.drift * (time - self.middle)


def fits(first: Felt, other: Felt) -> list[Clocks]:
    """Return the ways in which what two devices felt fits together, the one that explains most first."""
    found: list[Clocks] = []
    for start, drift in _places(first, other):
        clocks = _fitted(first, other, start, drift)
        if clocks is not None and all(
            abs(clocks.offset(one.middle) - one.offset(one.middle)) > APART for one in found
        ):
            found.append(clocks)
    return sorted(found, key=lambda clocks: -clocks.explained)


def _places(first: Felt, other: Felt) -> Iterator[tuple[float, float]]:
    """The other clock at the first row, and its drift, where much happens in both at once."""
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


def _fitted(first: Felt, other: Felt, start: float, drift: float) -> Clocks | None:
    """Fit everything from a place on, by Gauss and Newton; None if that leads out of what both felt."""
    rate = np.gradient(other.vector, 1.0 / RATE, axis=0)
    t, rotation = first.time - first.time[0], None
    for _ in range(ITERATIONS):
        then = start + (1.0 + drift) * t
        both = (first.known > 0.0) & (np.interp(then, other.time, other.known, 0.0, 0.0) == 1.0)
        if np.count_nonzero(both) < RATE or abs(drift) > 1.5 * DRIFT:
            return None
        middle = float(t[both].mean())
        w, u, since = first.vector[both], _at(other, other.vector, then[both]), t[both] - middle
        if rotation is None:
            rotation = Rotation.align_vectors(w - w.mean(0), u - u.mean(0))[0]
        u, moved = rotation.apply(u), rotation.apply(_at(other, rate, then[both]))
        X = np.concatenate(
            [np.stack([moved, moved * since[:, None]], axis=2), _turns(u),
             np.broadcast_to(np.eye(3), (len(w), 3, 3)), -first.lever[both]], axis=2,
        )  # fmt: skip
        p, left, inverse = _solved(X, w - u)
        step = p[:2] * min(1.0, 0.5 * APART / max(abs(p[0]), CONVERGED))
        start, drift = start + step[0] - step[1] * middle, drift + step[1]
        rotation = Rotation.from_rotvec(p[TURN]) * rotation
        if abs(step[0]) + abs(step[1]) * since[-1] < CONVERGED:
            break
    w = w - X[:, :, LEVER] @ p[LEVER]
    around, around_u = w - w.mean(0), u - u.mean(0)
    energy, lost = float(np.square(around).sum()), float(np.square(left).sum())
    errors = _covariance(X, left, inverse, since)
    at_ends = [errors[0, 0] + 2.0 * errors[0, 1] * end + errors[1, 1] * end**2 for end in since[[0, -1]]]
    return Clocks(
        middle=float(first.time[0] + middle),
        other=float(start + (1.0 + drift) * middle),
        drift=float(drift),
        half=(1.96 * float(np.sqrt(max(at_ends))), 1.96 * float(np.sqrt(errors[1, 1]))),
        correlation=float(np.sqrt(max(0.0, 1.0 - lost / max(energy, 1e-30)))),
        scale=float(np.sum(around * around_u) / max(np.square(around_u).sum(), 1e-30)),
        explained=max(0.0, energy - lost) / RATE,
        span=(float(first.time[both][0]), float(first.time[both][-1])),
    )


def _at(felt: Felt, values: Floats, then: Floats) -> Floats:
    return np.column_stack([np.interp(then, felt.time, axis) for axis in values.T])


def _turns(u: Floats) -> Floats:
    """Change of vectors with a small rotation about each axis, shape (T, 3, 3)."""
    return np.stack([np.cross(axis, u) for axis in np.eye(3)], axis=2)


def _solved(X: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Least squares: parameters, what is left of shape (T, 3), and the pseudo-inverse of XᵀX.

    Where all turns about one axis, the rotation about that axis shows in nothing and stays.
    """
    flat = X.reshape(-1, X.shape[2])
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-12)
    inverse = np.linalg.pinv((flat / size).T @ (flat / size), rcond=1e-9) / np.outer(size, size)
    p = inverse @ (flat.T @ y.ravel())
    return p, y - X @ p, inverse


def _covariance(X: Floats, left: Floats, inverse: Floats, since: Floats) -> Floats:
    """Covariance of parameters where what is left is correlated in time: the sandwich of White (1980), by blocks."""
    block = ((since - since[0]) // BLOCK).astype(np.intp)
    pulls = np.zeros((block[-1] + 1, X.shape[2]))
    np.add.at(pulls, block, np.einsum("tik,ti->tk", X, left))
    strong = np.abs(pulls[:, 0])
    used = max(2, int(np.count_nonzero(strong > 0.01 * strong.max())))
    found: Floats = inverse @ (pulls.T @ pulls) @ inverse * (used / (used - 1))
    return found
