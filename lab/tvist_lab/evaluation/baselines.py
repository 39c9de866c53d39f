"""Baselines for the comparison of shapers, besides waiting (the unshaped motion)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tvist_lab.evaluation.line import lengthened, shape
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.recordings import Floats
from tvist_lab.robust import robust_over
from tvist_lab.workspace import ranges, workspace
from tvist_plant.description import RobotDescription
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter
from tvist_shaping.taps import mean_delay

CONFIGURATIONS = 150
"""Number of configurations in which the range of the lowest mode is determined."""
SEARCHED = 2000
"""Number of configurations searched for the longest mean delay. A delay above it would exceed the motion's limits."""


@dataclass(frozen=True)
class Baseline:
    """An alternative to shaping by the estimated modes, for comparison."""

    name: str
    """Name in JSON."""
    label: str
    """Name for people."""
    shaper: str | None = None
    """Shaper of the catalogue; None if the motion itself is slower instead."""
    f_d: float | None = None
    """Design frequency [Hz]; None for the estimate at the move's target."""
    zeta: float | None = None
    """Design damping ratio [-]; None for the estimate at the move's target."""

    def shaped(
        self, recipe: Recipe, description: RobotDescription, move: Move, reference: Floats, ticks: int
    ) -> Floats:
        """Samples of the whole motion, shape (T, n) [rad].

        Args:
            recipe: Source of the estimates.
            description: The robot.
            move: The move.
            reference: Its reference, shape (T', n) [rad].
            ticks: Duration of the shaped motion that it is compared with.
        """
        start, target = np.array(move.start), np.array(move.target)
        if self.shaper is None:
            return lengthened(start, target, ticks)
        tvist = self.tvist(recipe, description, move)
        tvist.reset(start)
        return shape(tvist.filter, reference)[0]

    def tvist(self, recipe: Recipe, description: RobotDescription, move: Move) -> TvistFilter:
        """Return its fixed filter for a move; only for a baseline with a shaper.

        Args:
            recipe: Source of the estimates.
            description: The robot.
            move: The move.
        """
        assert self.shaper is not None
        f_d, zeta = self.f_d, self.zeta
        if f_d is None or zeta is None:
            there = recipe.estimator(description, move.mass, 1).estimate(np.array(move.target))
            f_d, zeta = float(there[0][0]), float(there[1][0])
        made = shaper(self.shaper)
        # Sufficient even if the estimate is too low.
        longest = max(1.0, 1.01 * made.duration_periods / f_d)
        return TvistFilter(made, Fixed([f_d], [zeta]), joints=description.joints, max_delay=longest)


EQUAL_DURATION = Baseline("equal_duration_double_s", "longer double S")
FROZEN = Baseline("zv_frozen_at_end", "ZV for the end pose", "zv")


def baselines(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> tuple[Baseline, ...]:
    """Return all baselines; fixed ones are designed for the lowest mode's range over workspace and payloads.

    Args:
        recipe: Source of the estimates.
        description: The robot.
        masses: Smallest and largest payload [kg].
    """
    f_d, zeta = workspace_range(recipe, description, masses)
    fixed = []
    for name in ("mzv", "ei2", "ei3"):
        bounded = (zeta[0], min(zeta[1], 0.999 * shaper(name).zeta_max))
        design = robust_over(name, f_d, bounded)
        fixed.append(Baseline(f"fixed_{name}", f"fixed {name.upper()}", name, *design))
    return (EQUAL_DURATION, FROZEN, *fixed)


def workspace_range(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Smallest and largest damped frequency [Hz] and damping ratio [-] of the lowest mode, as estimated."""
    found = [
        (f_d[0], zeta[0]) for f_d, zeta in _over_workspace(recipe, description, masses, 1, CONFIGURATIONS)
    ]
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def longest_mean_delay(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float], modes: int
) -> float:
    """Return the longest mean delay of the product of the modes' ZV shapers, over workspace and payloads [s].

    Args:
        recipe: Source of the estimates.
        description: The robot.
        masses: Smallest and largest payload [kg].
        modes: Number of modes.
    """
    return max(
        mean_delay(f_d, zeta) for f_d, zeta in _over_workspace(recipe, description, masses, modes, SEARCHED)
    )


def _over_workspace(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float], modes: int, count: int
) -> Iterator[tuple[Floats, Floats]]:
    """Damped frequencies [Hz] and damping ratios [-] of the lowest modes, with the smallest and the largest payload."""
    region = workspace(ranges(description))
    for mass in sorted(set(masses)):
        estimator = recipe.estimator(description, mass, modes)
        for q in region.spread(count, description.joints, seed=0):
            yield estimator.estimate(q)
