"""Streams of set-points that turn to other targets on the way, and are stopped somewhere."""

import numpy as np
import ruckig

from tvist_controller.api.line import MotionLimits
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER
from tvist_lab.workspace import ranges, workspace
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

RETARGETED = (0.2, 0.8)
"""Shortest and longest time after which a stream turns to another target [s]."""
TURNS = 4
"""Number of targets of a stream."""


def stopped_stream(
    description: RobotDescription, start: Floats, seed: int, limits: MotionLimits = PAPER
) -> Floats:
    """Draw a stream that uses its limits fully, and is brought to rest within them before it reaches its last target.

    Args:
        description: The robot, whose workspace the targets are drawn from.
        start: Joint angles at which it begins at rest, shape (n,) [rad].
        seed: Seed of targets and times.
        limits: Limits of every joint.

    Returns:
        One sample a tick, until the arm rests, shape (T, n) [rad].
    """
    joints, random = len(start), np.random.default_rng([seed, 71])
    region = workspace(ranges(description))
    used = min(len(region.low), joints)
    generator = ruckig.Ruckig(joints, PERIOD)
    state, following = ruckig.InputParameter(joints), ruckig.OutputParameter(joints)
    state.max_velocity = [limits.velocity] * joints
    state.max_acceleration = [limits.acceleration] * joints
    state.max_jerk = [limits.jerk] * joints
    state.current_position = np.asarray(start, dtype=float).tolist()
    out: list[Floats] = []

    def step() -> bool:
        result = generator.update(state, following)
        following.pass_to_input(state)
        out.append(np.array(state.current_position))
        return bool(result == ruckig.Result.Finished)

    for _ in range(TURNS):
        target = np.zeros(joints)
        target[:used] = random.uniform(np.array(region.low)[:used], np.array(region.high)[:used])
        state.target_position = target.tolist()
        for _ in range(round(random.uniform(*RETARGETED) / PERIOD)):
            step()
    state.control_interface = ruckig.ControlInterface.Velocity
    state.target_velocity = state.target_acceleration = [0.0] * joints
    while not step():
        pass
    return np.array(out)
