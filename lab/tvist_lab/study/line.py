"""The control line without a server: a reference, its shaping, and the response of an arm.

A shaper sees only the reference, so its output is computed first and then applied to any number of arms. The
result equals that of the tick-by-tick line to the last bit.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tvist_controller.api.line import (
    DriveCommandSeries,
    DrivenLine,
    ElasticFeedForward,
    JointLine,
    MotionLimits,
    Trajectory,
    quickest_motion,
    respond,
)
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import PERIOD, SimulatedArm

PAPER = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""The paper's limits, also the defaults of `move_j`."""
REST = 0.7  # time simulated after the end of the shaped reference [s]

RESTING = 4  # ticks at rest before the motion


def point_to_point(start: Floats, target: Floats, limits: MotionLimits = PAPER) -> Floats:
    """Return a double S to the target, from the first sample that may differ from the start, (T, n) [rad]."""
    return samples_of(quickest_motion(JointLine(start, target), limits))


def samples_of(trajectory: Trajectory) -> Floats:
    """Return the samples of a trajectory from the first that may move to the last, shape (T, n) [rad]."""
    samples = []
    while not trajectory.finished:
        samples.append(trajectory.next())
    return np.array(samples)


def round_a_corner(start: Floats, corner: Floats, target: Floats) -> Floats:
    """Return a curved path of two double S; the second starts after 3/4 of the first, shape (T, n) [rad]."""
    first, second = point_to_point(start, corner), point_to_point(corner, target)
    joined = (3 * len(first)) // 4
    length = max(joined + len(second), len(first))
    path = np.tile(first[-1], (length, 1))
    path[: len(first)] = first
    late = np.tile(second[-1], (length - joined, 1))
    late[: len(second)] = second
    path[joined:] += late - corner
    return path


def lengthened(start: Floats, target: Floats, ticks: int, limits: MotionLimits = PAPER) -> Floats:
    """Return a double S whose jerk is reduced such that it lasts `ticks`, to within a tick, (T, n) [rad]."""
    low, high = np.log(1e-2 * limits.jerk), np.log(limits.jerk)
    for _ in range(30):  # the duration increases as the jerk decreases
        middle = 0.5 * (low + high)
        slower = MotionLimits(limits.velocity, limits.acceleration, float(np.exp(middle)))
        if quickest_motion(JointLine(start, target), slower).duration > ticks * PERIOD:
            low = middle
        else:
            high = middle
    return point_to_point(
        start, target, MotionLimits(limits.velocity, limits.acceleration, float(np.exp(high)))
    )


class ControlLine:
    """The control line of one controller from shaped reference to drives, without a shaper.

    The arm rests at `start`, shape (n,) [rad]; `law` is the identified friction to feed forward, if known.
    """

    def __init__(
        self, description: RobotDescription, start: Floats, declared: Payload, law: Floats | None = None
    ) -> None:
        self._start = start
        self._line = DrivenLine(description, declared, law)

    def follow(
        self,
        reference: Floats,
        shaped: Floats,
        delay: float = 0.0,
        elastic: ElasticFeedForward | None = None,
        law: Floats | None = None,
    ) -> "FollowedReference":
        """Return the drives' commands, for any arm, to follow a shaped reference from rest and then rest.

        The arm follows `shaped` (T', n) [rad]; results are compared with the unshaped `reference`, (T, n)
        [rad]. `delay` [s] is declared by the shaper. `elastic` replaces the feed-forward of the paper's
        controller, `law` the friction of this line.
        """
        ticks = RESTING + max(len(shaped), len(reference)) + round(REST / PERIOD)
        driven = self._line.drive(self._start, shaped, ticks, RESTING, elastic, law)
        return FollowedReference(self._start, reference, driven, delay)


class FollowedReference:
    """A shaped reference, and the drives' commands to follow it; see `ControlLine.follow`."""

    def __init__(self, start: Floats, reference: Floats, driven: DriveCommandSeries, delay: float) -> None:
        ticks, n = len(driven.targets), len(start)
        late = round(driven.delay / PERIOD)
        targets = driven.targets.copy()
        targets[late:] = driven.targets[: ticks - late]
        q = np.empty((ticks, n))
        q[:RESTING], q[RESTING:] = start, reference[-1]
        q[RESTING : RESTING + len(reference)] = reference
        tick_of = np.arange(ticks, dtype=float)
        self._driven = driven
        self._columns = {
            "tick": tick_of, "timestamp": PERIOD * tick_of,
            "reference_q": q, "target_q": targets[:, 0], "target_qd": targets[:, 1], "target_qdd": targets[:, 2],
            "shaper_delay": np.full(ticks, delay + driven.delay),
        }  # fmt: skip

    def simulate(self, plant: SimulatedArm, seed: int) -> Recording:
        """Let a plant follow the reference, with a seed for sensor noise and gear errors.

        The recording starts one tick before the motion. It has the targets that the drives receive, so ticks
        that a feed-forward needs for derivatives count as delay. Raises ValueError if the plant does not
        provide the truth.
        """
        response = respond(plant, self._driven, seed)
        pose = np.zeros((len(response.specific_force), 6))
        pose[:, 3:] = Rotation.from_matrix(response.flange_rotation).as_rotvec()
        felt = {"truth_tool_acceleration": response.specific_force, "truth_flange_pose": pose}
        return Recording({**self._columns, **felt})
