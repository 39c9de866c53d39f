"""What any shaper has to be compared with: waiting (the unshaped motion), and these."""

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
"""Over which the range of the lowest mode is looked for."""
SEARCHED = 2000
"""Over which the longest mean delay is looked for: what exceeds it would exceed the limits of a motion, too."""


@dataclass(frozen=True)
class Baseline:
    """A way to make a move that shaping by the modes has to beat."""

    name: str
    """In JSON."""
    label: str
    """For people."""
    shaper: str | None = None
    """Shaper of the catalogue; None: no shaper, the motion itself takes longer."""
    f_d: float | None = None
    """Frequency it is designed for; None: the estimate at the move's target [Hz]."""
    zeta: float | None = None
    """Damping it is designed for [-]."""

    def shaped(
        self, recipe: Recipe, description: RobotDescription, move: Move, reference: Floats, ticks: int
    ) -> Floats:
        """Samples of the whole motion, shape (T, n) [rad].

        Args:
            recipe: Says where estimates come from.
            description: The robot.
            move: The move.
            reference: Its reference, shape (T', n) [rad].
            ticks: How long the shaped motion lasts that this is compared with.
        """
        start, target = np.array(move.start), np.array(move.target)
        if self.shaper is None:
            return lengthened(start, target, ticks)
        tvist = self.tvist(recipe, description, move)
        tvist.reset(start)
        return shape(tvist.filter, reference)[0]

    def tvist(self, recipe: Recipe, description: RobotDescription, move: Move) -> TvistFilter:
        """Its fixed filter for a move; only where it has a shaper.

        Args:
            recipe: Says where estimates come from.
            description: The robot.
            move: The move.
        """
        assert self.shaper is not None
        f_d, zeta = self.f_d, self.zeta
        if f_d is None or zeta is None:
            there = recipe.estimator(description, move.mass, 1).estimate(np.array(move.target))
            f_d, zeta = float(there[0][0]), float(there[1][0])
        made = shaper(self.shaper)
        # However low a wrong estimate is.
        longest = max(1.0, 1.01 * made.duration_periods / f_d)
        return TvistFilter(made, Fixed([f_d], [zeta]), joints=description.joints, max_delay=longest)


EQUAL_DURATION = Baseline("equal_duration_double_s", "longer double S")
FROZEN = Baseline("zv_frozen_at_end", "ZV for the end pose", "zv")


def baselines(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> tuple[Baseline, ...]:
    """All of them; the fixed ones are designed for the lowest mode's range over the workspace and the payloads.

    Args:
        recipe: Says where estimates come from.
        description: The robot.
        masses: Least and largest payload [kg].
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
    """Least and largest damped frequency [Hz] and damping ratio [-] of the lowest mode, as estimated."""
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
        recipe: Says where estimates come from.
        description: The robot.
        masses: Least and largest payload [kg].
        modes: Whose shapers they are.
    """
    return max(
        mean_delay(f_d, zeta) for f_d, zeta in _over_workspace(recipe, description, masses, modes, SEARCHED)
    )


def _over_workspace(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float], modes: int, count: int
) -> Iterator[tuple[Floats, Floats]]:
    """Damped frequencies [Hz] and damping ratios [-] of the lowest modes, with the least payload and the largest."""
    region = workspace(ranges(description))
    for mass in sorted(set(masses)):
        estimator = recipe.estimator(description, mass, modes)
        for q in region.spread(count, description.joints, seed=0):
            yield estimator.estimate(q)
