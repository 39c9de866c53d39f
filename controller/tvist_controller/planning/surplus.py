"""How far a filter may exceed the limits of a reference that uses all of the arm's limits."""

from collections.abc import Iterable

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import arm_limits
from tvist_plant.description import RobotDescription
from tvist_shaping.base import Filter
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.failures import FAILURES
from tvist_shaping.filter import QUICKEST

POSTURES = 40  # number of postures at which modes are computed
HALF_STEP = 0.03  # half the travel over which their change is measured [rad]
TIME = 0.01  # time over which the quickest change of modes is measured [s]
MARGIN = 1.1  # margin for postures not computed [-]
RISE = 15.0  # ratio of largest D̈ to largest Ḋ, twice that of random streams [1/s]
STEADY = 2.0  # ratio of a constant-delay filter's excess in a stream to that in a motion, its `excess` [-]


def surplus_of(
    tvist: Filter, estimators: Iterable[Estimator], description: RobotDescription
) -> tuple[float, float]:
    """Return relative excesses of velocity and acceleration over a reference's, see `Filter.surplus` [-].

    While the mean delay D shrinks, velocity is 1 - Ḋ times the reference's, and acceleration contains (1 -
    Ḋ)² ẍ - ẋ D̈. Modes of a smooth estimator change quickest if all joints move at full speed in the worst
    direction; those of an abrupt one at most as `TvistFilter` allows. Negative weights add at most what the
    acceleration limit permits within the filter's length. `estimators` are the filter's, one per payload.
    """
    limits, peak = arm_limits(description), tvist.peak
    reach = np.minimum(description.limits.position, np.pi)
    hastens = 0.0
    for estimator in estimators:
        random = np.random.default_rng(0)
        if tvist.mean_delay_of(*estimator.settle(np.zeros_like(reach))) is None:
            break
        for _ in range(POSTURES):
            try:
                hastens = max(
                    hastens, _hastens(tvist, estimator, random.uniform(-reach, reach), limits.velocity)
                )
            except FAILURES:  # a user's shaper reports this when it is used
                continue
    hastens *= MARGIN
    hardens = (2.0 + RISE * limits.velocity / limits.acceleration) * hastens + STEADY * tvist.excess
    negative = min(peak - 1.0, limits.acceleration * tvist.delay / (2.0 * limits.velocity))
    return (1.0 + hastens) * (1.0 + negative) - 1.0, (1.0 + hardens) * peak - 1.0


def _hastens(tvist: Filter, estimator: Estimator, q: Floats, velocity: float) -> float:
    """Return the largest -Ḋ at a posture and joint velocity [-]."""

    def delay(f_d: Floats, zeta: Floats) -> float:
        return tvist.mean_delay_of(f_d, zeta) or 0.0

    f_d, zeta = estimator.settle(q)
    if estimator.abrupt:
        higher, change = f_d * (1.0 + QUICKEST[0] * TIME), QUICKEST[1] * TIME
        least = min(delay(higher, np.maximum(zeta + sign * change, 0.0)) for sign in (-1.0, 1.0))
        return (delay(f_d, zeta) - least) / TIME
    steps = HALF_STEP * np.eye(len(q))
    ways = [
        abs(delay(*estimator.estimate(q + step)) - delay(*estimator.estimate(q - step))) for step in steps
    ]
    return sum(ways) * velocity / (2.0 * HALF_STEP)
