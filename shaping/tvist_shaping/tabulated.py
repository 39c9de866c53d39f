"""Shapers whose amplitudes and times have no closed form in ζ: solved once, then interpolated.

The equations are solved at Chebyshev nodes from zero damping to the highest one, each starting from the previous
solution. The polynomial through the nodes is as exact as the solutions, smooth in ζ, and takes a microsecond per tick.
"""

import math
from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.impulse_train import Impulses, check_mode

NODES = 32
"""Number of Chebyshev nodes to start with.

It is doubled where the equations end at a branch point just beyond the highest damping, since the polynomials converge
slowly there.
"""
CONVERGED = 1e-7  # largest magnitude of the last coefficients of converged polynomials [-]
MOST_NODES = 256


class Tabulated(ABC):
    """Impulses of one mode as polynomials in ζ."""

    def __init__(
        self, start: Floats, zeta_max: float, instead: str, duration_periods: float | None = None
    ) -> None:
        """Compute the polynomials; if the longest duration [periods] is given, only at the first evaluation.

        `start` has the unknowns without damping; `instead` says what to use beyond `zeta_max`.
        """
        self._start, self._instead = start, instead
        self.zeta_max = zeta_max  # damping ratios must stay below this [-]
        self.duration_periods = self.longest() if duration_periods is None else duration_periods

    @abstractmethod
    def follow(self, zeta: float, near: Floats) -> tuple[Floats, Floats, Floats]:
        """Solve at ζ from the solution at a nearby ζ; return it, A [-] and τ in damped periods [-]."""

    def longest(self) -> float:
        """Return the longest duration over all ζ, to within 1e-9 damped periods [-]."""
        ends = ((0.0, self._start), (self.zeta_max, self._polynomials[1]))
        durations = [float(self.follow(end, x)[2][-1]) for end, x in ends]
        durations += [float(self._at(zeta)[1][-1]) for zeta in np.linspace(0.0, self.zeta_max, 33)[1:-1]]
        return round(max(durations), 9)

    @cached_property
    def _polynomials(self) -> tuple[Floats, Floats]:
        """Coefficients of amplitudes and times, shape (nodes, 2N), and the unknowns at the last node."""
        nodes = NODES
        coefficients, last = self._tabulate(nodes)
        while np.abs(coefficients[-3:]).max() > CONVERGED and nodes < MOST_NODES:
            nodes *= 2
            coefficients, last = self._tabulate(nodes)
        return coefficients, last

    def _tabulate(self, number: int) -> tuple[Floats, Floats]:
        k, zeta_max = np.arange(number), self.zeta_max
        nodes = np.cos((k + 0.5) * math.pi / number)[::-1]
        values, last, x, zeta = [], self._start, self._start, 0.0
        slope = np.zeros(last.size)
        for node in nodes:
            step, zeta = 0.5 * zeta_max * (1.0 + float(node)) - zeta, 0.5 * zeta_max * (1.0 + float(node))
            x, A, periods = self.follow(zeta, last + step * slope)
            slope, last = (x - last) / step, x
            values.append(np.concatenate([A, periods]))
        terms = np.cos(np.outer(np.arccos(nodes), k))  # T_k at the nodes, which are orthogonal
        return (terms.T @ np.array(values)) * np.where(k == 0, 1.0, 2.0)[:, None] / number, last

    def __call__(self, f_d: float, zeta: float) -> Impulses:
        """Evaluate the impulses of a mode, whose damping ratio is below `zeta_max`."""
        check_mode(f_d, zeta, self.zeta_max, self._instead)
        A, periods = self._at(zeta)
        return Impulses._by_construction(A, periods / f_d)  # noqa: SLF001  solved, and of sum 1

    def _at(self, zeta: float) -> tuple[Floats, Floats]:
        angle = math.acos(min(max(2.0 * zeta / self.zeta_max - 1.0, -1.0), 1.0))
        coefficients = self._polynomials[0]
        A, periods = np.split(np.cos(angle * np.arange(len(coefficients))) @ coefficients, 2)
        periods[0] = 0.0
        return A / A.sum(), periods
