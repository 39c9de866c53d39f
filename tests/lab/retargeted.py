"""Streams of somebody else's: joint set-points that keep the limits to the last digit and turn to ever new targets."""

from dataclasses import dataclass

import numpy as np
import ruckig

from tvist_controller.trajectory import MotionLimits
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER
from tvist_lab.study.moves import WITH_WRISTS
from tvist_lab.workspace import WORKSPACE
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

RETARGETED = (0.1, 1.5)
"""Least and longest time after which a stream turns to a new target, wherever it is by then [s]."""


@dataclass(frozen=True)
class Peaks:
    """Largest of a stream, over the limits of the reference."""

    velocity: float
    """[-]."""
    acceleration: float
    """[-]."""


def retargeted(
    joints: int,
    seconds: float,
    seed: int,
    *,
    wrists: bool = True,
    together: bool = False,
    limits: MotionLimits = PAPER,
) -> Floats:
    """A stream whose joints go to random targets and are called away from them, often before they are there.

    Args:
        joints: Number of joints of the arm.
        seconds: How long it is [s].
        seed: Seed of the targets and of the times at which they change.
        wrists: Turn the two outer joints of the wrist, too; otherwise they rest at zero.
        together: All joints arrive at the same time; otherwise each goes at its own limits.
        limits: Limits of each joint.

    Returns:
        One sample a tick, shape (T, joints) [rad].
    """
    random = np.random.default_rng(seed)
    region, ends = WITH_WRISTS if wrists else WORKSPACE, np.zeros((2, joints))
    for end, side in zip(ends, (region.low, region.high), strict=True):
        end[: len(side)] = side[:joints]
    low, high = ends
    generator = ruckig.Ruckig(joints, PERIOD)
    state, following = ruckig.InputParameter(joints), ruckig.OutputParameter(joints)
    state.max_velocity = [limits.velocity] * joints
    state.max_acceleration = [limits.acceleration] * joints
    state.max_jerk = [limits.jerk] * joints
    state.synchronization = ruckig.Synchronization.Time if together else ruckig.Synchronization.No
    state.current_position = random.uniform(low, high).tolist()
    out, left = np.empty((round(seconds / PERIOD), joints)), 0
    for tick in range(len(out)):
        out[tick] = state.current_position
        if left == 0:
            state.target_position = random.uniform(low, high).tolist()
            left = round(random.uniform(*RETARGETED) / PERIOD)
        generator.update(state, following)
        following.pass_to_input(state)
        left -= 1
    return out


def peaks(q: Floats, limits: MotionLimits = PAPER) -> Peaks:
    """Return the peaks of positions at every tick, shape (T, n) [rad], by first and second difference."""
    qd, qdd = (float(np.abs(np.diff(q, order, axis=0)).max()) / PERIOD**order for order in (1, 2))
    return Peaks(qd / limits.velocity, qdd / limits.acceleration)


def streamed(tvist: Filter, reference: Floats) -> Floats:
    """What a filter makes of a stream, whose end nobody tells it; shape (T, n) [rad]."""
    tvist.reset(reference[0])
    tvist.aim(None)
    return np.array([tvist.filter(q) for q in reference])
