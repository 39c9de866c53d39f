"""Ranges of an arm's modes over its workspace, as estimated, for shapers that are designed for all of it."""

from collections.abc import Iterator

import numpy as np

from tvist_lab.recordings import Floats
from tvist_lab.robust import robust_over
from tvist_lab.study.recipes import Recipe
from tvist_lab.workspace import ranges, workspace
from tvist_plant.description import RobotDescription
from tvist_shaping.catalogue import shaper
from tvist_shaping.taps import mean_delay

CONFIGURATIONS = 150
"""Number of configurations in which the range of the lowest mode is determined."""
SEARCHED = 2000
"""Number of configurations searched for the longest mean delay. A delay above it would exceed the motion's limits."""

Range = tuple[float, float]


def robust(name: str, recipe: Recipe, description: RobotDescription, masses: Range) -> Range:
    """Design frequency [Hz] and damping ratio [-] of a fixed shaper for the lowest mode's range over the workspace."""
    f_d, zeta = workspace_range(recipe, description, masses)
    return robust_over(name, f_d, (zeta[0], min(zeta[1], 0.999 * shaper(name).zeta_max)))


def workspace_range(recipe: Recipe, description: RobotDescription, masses: Range) -> tuple[Range, Range]:
    """Smallest and largest damped frequency [Hz] and damping ratio [-] of the lowest mode, as estimated."""
    found = [
        (f_d[0], zeta[0]) for f_d, zeta in _over_workspace(recipe, description, masses, 1, CONFIGURATIONS)
    ]
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def longest_mean_delay(recipe: Recipe, description: RobotDescription, masses: Range, modes: int) -> float:
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
    recipe: Recipe, description: RobotDescription, masses: Range, modes: int, count: int
) -> Iterator[tuple[Floats, Floats]]:
    """Damped frequencies [Hz] and damping ratios [-] of the lowest modes, with the smallest and the largest payload."""
    region = workspace(ranges(description))
    for mass in sorted(set(masses)):
        estimator = recipe.estimator(description, mass, modes)
        for q in region.spread(count, description.joints, seed=0):
            yield estimator.estimate(q)
