"""Baselines for the comparison of shapers, besides waiting (the unshaped motion)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tvist_controller.api import MotionLimits
from tvist_lab.evaluation.line import PAPER, lengthened, point_to_point, shape
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
    modes: int = 1
    """Number of lowest modes at the move's target, each of which gets a shaper."""
    for_payload: bool = False
    """Whether it is designed for the range of the lowest mode over the workspace with the declared payload."""
    jerk_time: bool = False
    """Whether the motion's jerk lasts a period of the lowest mode at the target, which then is not excited."""

    @property
    def told_target(self) -> bool:
        """Whether it is designed for the end of each move."""
        return self.f_d is None and not self.for_payload

    def shaped(
        self,
        recipe: Recipe,
        description: RobotDescription,
        move: Move,
        reference: Floats,
        ticks: int,
        limits: MotionLimits = PAPER,
    ) -> Floats:
        """Samples of the whole motion, shape (T, n) [rad].

        Args:
            recipe: Source of the estimates.
            description: The robot.
            move: The move.
            reference: Its reference, shape (T', n) [rad].
            ticks: Duration of the shaped motion that it is compared with.
            limits: Limits of the motion.
        """
        start, target = np.array(move.start), np.array(move.target)
        if self.jerk_time:
            f_d = float(recipe.estimator(description, move.mass, 1).estimate(target)[0][0])
            return point_to_point(start, target, replace(limits, jerk=limits.acceleration * f_d))
        if self.shaper is None:
            return lengthened(start, target, ticks, limits)
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
        made, f_d, zeta = shaper(self.shaper), self.f_d, self.zeta
        if self.for_payload:
            f_d, zeta = _robust(self.shaper, recipe, description, (move.mass, move.mass))
        if f_d is None or zeta is None:
            there = recipe.estimator(description, move.mass, self.modes).estimate(np.array(move.target))
            frequencies, damping = there[0].tolist(), there[1].tolist()
        else:
            frequencies, damping = [f_d], [zeta]
        # Sufficient even if the estimate is too low.
        longest = max(1.0, 1.01 * sum(made.duration_periods / f for f in frequencies))
        return TvistFilter(made, Fixed(frequencies, damping), joints=description.joints, max_delay=longest)


EQUAL_DURATION = Baseline("equal_duration_double_s", "longer double S")
FROZEN = Baseline("zv_frozen_at_end", "ZV for the end pose", "zv")
FROZEN_3 = Baseline("zv_3_modes_frozen_at_end", "ZV of three modes for the end pose", "zv", modes=3)
TUNED_JERK = Baseline("double_s_of_one_period", "double S whose jerk lasts a period", jerk_time=True)
FOR_PAYLOAD = tuple(
    Baseline(f"{name}_for_payload", f"fixed {name.upper()} for the declared payload", name, for_payload=True)
    for name in ("mzv", "ei", "ei3")
)


def baselines(
    recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> tuple[Baseline, ...]:
    """Return all baselines; fixed ones are designed for the lowest mode's range over workspace and payloads.

    Args:
        recipe: Source of the estimates.
        description: The robot.
        masses: Smallest and largest payload [kg].
    """
    fixed = [
        Baseline(f"fixed_{name}", f"fixed {name.upper()}", name, *_robust(name, recipe, description, masses))
        for name in ("mzv", "ei2", "ei3")
    ]
    known = recipe.calibration
    several = (FROZEN_3,) if known is not None and known.modal is not None else ()
    return (EQUAL_DURATION, TUNED_JERK, FROZEN, *several, *FOR_PAYLOAD, *fixed)


def _robust(
    name: str, recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> tuple[float, float]:
    """Design frequency [Hz] and damping ratio [-] of a fixed shaper for the lowest mode's range over the workspace."""
    f_d, zeta = workspace_range(recipe, description, masses)
    return robust_over(name, f_d, (zeta[0], min(zeta[1], 0.999 * shaper(name).zeta_max)))


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
