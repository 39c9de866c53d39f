"""A blend of the tool with the length of its own way as parameter, so that an even parameter is an even speed."""

import numpy as np

from tvist_controller.paths.tool_curves import ToolBlend, ToolCurve, ToolState
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.spline import evaluate, hermite

SLOWEST = 0.25
"""Speed of the tool relative to the parameter, below which a blend turns back too sharply to be converted [-]."""
PIECES = 64
"""Number of pieces of the conversion."""
EVEN = 1e-9
"""Difference from an even speed at the ends that is rounding [-]."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


def evenly(blend: ToolBlend) -> "ToolBlend | EvenBlend":
    """Return the blend with an even speed of the tool; unchanged if it nearly stops on its way."""
    speeds, _ = blend.shape(np.linspace(0.0, blend.length, PIECES + 1))
    ends = abs(float(speeds[0]) - 1.0) + abs(float(speeds[-1]) - 1.0)
    return blend if float(speeds.min()) < SLOWEST or ends > EVEN else EvenBlend(blend)


class EvenBlend(ToolCurve):
    """A blend whose parameter is the length of its way."""

    def __init__(self, blend: ToolBlend) -> None:
        self._blend = blend
        places = np.linspace(0.0, blend.length, PIECES + 1)
        half = 0.5 * np.diff(places)
        inside = (places[:-1] + half)[:, None] + half[:, None] * _NODES
        speeds = blend.shape(inside.reshape(-1))[0].reshape(inside.shape)
        self._lengths = np.concatenate(([0.0], np.cumsum(half * (speeds @ _WEIGHTS))))
        self.length = float(self._lengths[-1])
        first, second = blend.moved(places)
        speed = np.linalg.norm(first, axis=1)
        place, rate, change = places, 1.0 / speed, -(first * second).sum(axis=1) / speed**4
        starts = (place[:-1, None], rate[:-1, None], change[:-1, None])
        ends = (place[1:, None], rate[1:, None], change[1:, None])
        coefficients = hermite(np.diff(self._lengths)[:, None], starts, ends)
        self._coefficients = np.ascontiguousarray(np.moveaxis(coefficients, 0, 1))

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        place, rate, change = (float(values[0]) for values in self._places(np.array([s])))
        pose, first, second = self._blend.at(place)
        return ToolState(pose, first * rate, second * rate**2 + first * change)

    def shape(self, s: Floats) -> tuple[Floats, Floats]:
        """Return the sizes of dp/ds and d²p/ds² at k lengths, each of shape (k,) [-, 1/m]."""
        places, rates, changes = self._places(s)
        first, second = self._blend.moved(places)
        bent = second * rates[:, None] ** 2 + first * changes[:, None]
        return np.linalg.norm(first, axis=1) * rates, np.linalg.norm(bent, axis=1)

    def _places(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        out = np.empty((4, len(s), 1))
        evaluate(self._lengths, self._coefficients, s, out)
        return out[0, :, 0], out[1, :, 0], out[2, :, 0]
