"""The control line without a server: a reference, its shaping, and the response of an arm.

A shaper sees only the reference, so its output can be computed first and then be applied to any number of arms. The
result equals that of the tick-by-tick line to the last bit.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from tvist_controller.api import (
    STILL,
    ControlCycle,
    ElasticFeedForward,
    JointLine,
    MotionLimits,
    Target,
    Trajectory,
    quickest_motion,
    truth_of,
)
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import PERIOD, Plant
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

PAPER = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""The paper's limits, which are also the defaults of `move_j`."""
LONGEST = 3.0
"""Time after the reference's end within which a shaped reference has to end [s]."""
REST = 0.7
"""Time simulated after the end of the shaped reference [s]."""

Step = Callable[[Floats], Floats]
"""A shaper in operation: converts a sample to a shaped sample, both of shape (n,) [rad]."""


class Unchanged(TvistFilter):
    """Returns its input, for trajectories that are shaped already."""

    def __init__(self, joints: int) -> None:
        super().__init__(shaper("none"), Fixed([10.0], [0.1]), joints=joints)

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Return the sample."""
        return np.asarray(q_ref)


class Played(Trajectory):
    """A reference that is completely known.

    Args:
        q: Its samples, shape (T, n) [rad].
    """

    def __init__(self, q: Floats) -> None:
        self._q, self._next = q, 0

    def next(self) -> Floats:
        """Return the next sample; after the last one, return that again."""
        q: Floats = self._q[min(self._next, len(self._q) - 1)]
        self._next += 1
        return q

    @property
    def finished(self) -> bool:
        """Whether the last sample was returned."""
        return self._next >= len(self._q)


def point_to_point(start: Floats, target: Floats, limits: MotionLimits = PAPER) -> Floats:
    """Reference of a double S, from the first sample that may move to the one at the target, shape (T, n) [rad]."""
    return samples_of(quickest_motion(JointLine(start, target), limits, PERIOD))


def samples_of(trajectory: Trajectory) -> Floats:
    """Samples of a trajectory from the first that may move to the last, shape (T, n) [rad]."""
    samples = []
    while not trajectory.finished:
        samples.append(trajectory.next())
    return np.array(samples)


def round_a_corner(start: Floats, corner: Floats, target: Floats, limits: MotionLimits = PAPER) -> Floats:
    """A curved path: two double S, of which the second begins when a quarter of the first's time is left.

    Returns:
        Samples, shape (T, n) [rad]. While both move, velocity and acceleration are sums.
    """
    first, second = point_to_point(start, corner, limits), point_to_point(corner, target, limits)
    joined = (3 * len(first)) // 4
    length = max(joined + len(second), len(first))
    path = np.tile(first[-1], (length, 1))
    path[: len(first)] = first
    late = np.tile(second[-1], (length - joined, 1))
    late[: len(second)] = second
    path[joined:] += late - corner
    return path


def lengthened(start: Floats, target: Floats, ticks: int, limits: MotionLimits = PAPER) -> Floats:
    """Reference of a double S with reduced jerk that takes as long as another motion; it uses no shaper and no model.

    Args:
        start: Joint angles at the start, shape (n,) [rad].
        target: Joint angles at the end, shape (n,) [rad].
        ticks: Requested duration.
        limits: Limits of the motion.

    Returns:
        Samples, shape (T, n) [rad]; T differs from the request by at most a tick.
    """
    low, high = np.log(1e-2 * limits.jerk), np.log(limits.jerk)
    for _ in range(30):  # the duration increases as the jerk decreases
        middle = 0.5 * (low + high)
        slower = MotionLimits(limits.velocity, limits.acceleration, float(np.exp(middle)))
        if quickest_motion(JointLine(start, target), slower, PERIOD).duration > ticks * PERIOD:
            low = middle
        else:
            high = middle
    return point_to_point(
        start, target, MotionLimits(limits.velocity, limits.acceleration, float(np.exp(high)))
    )


def shape(step: Step, reference: Floats) -> tuple[Floats, bool]:
    """Shape a reference that is at rest at its last sample.

    Args:
        step: The shaper, at rest at the first sample.
        reference: Reference, shape (T, n) [rad].

    Returns:
        Shaped samples up to the last one that moves and for a while longer, shape (T', n) [rad]; and whether it
        ended.
    """
    target, shaped = reference[-1], [step(q) for q in reference]
    quiet = 0
    for _ in range(round(LONGEST / PERIOD)):
        shaped.append(step(target))
        moved = max(np.abs(shaped[-1] - shaped[-2]).max(), np.abs(shaped[-1] - target).max())
        quiet = quiet + 1 if moved <= STILL else 0
        if quiet >= 10:
            return np.array(shaped), True
    return np.array(shaped), False


def simulate(
    cycle: ControlCycle,
    start: Floats,
    reference: Floats,
    shaped: Floats,
    seed: int,
    delay: float = 0.0,
    elastic: ElasticFeedForward | None = None,
) -> Recording:
    """Let a plant follow a shaped reference from rest, and then rest for a while.

    Args:
        cycle: The control line, with `Unchanged` as its filter and any plant.
        start: Joint angles at which the arm rests, shape (n,) [rad].
        reference: The unshaped reference, which everything is compared with, shape (T, n) [rad].
        shaped: The reference that the arm follows, shape (T', n) [rad].
        seed: Seed of sensor noise and gear errors.
        delay: Delay that the shaper declares [s].
        elastic: Elastic feed-forward for the drives; None for that of the paper's controller.

    Returns:
        Columns for the metrics on a common clock, from a tick before the motion on. Targets are those that the drives
        receive, so that ticks in which a feed-forward differentiates count as delay.

    Raises:
        ValueError: The plant does not provide the truth.
    """
    plant = cycle.plant
    cycle.use(cycle.tvist, elastic)
    cycle.reset(start, seed=seed)
    resting = 4
    ticks = resting + max(len(shaped), len(reference)) + round(REST / PERIOD)
    n = len(start)
    q, target = np.empty((2, ticks, n))
    qd, qdd = np.empty((2, ticks, n))
    force, rotation = np.empty((ticks, 3)), np.empty((ticks, 3, 3))
    for tick in range(ticks):
        if tick == resting:
            cycle.start(Played(shaped))
        sample = cycle.step()
        truth = truth_of(plant)
        aim: Target = sample.target
        target[tick], qd[tick], qdd[tick] = aim.q, aim.qd, aim.qdd
        force[tick], rotation[tick] = truth.specific_force, truth.flange_rotation
    late = round(cycle.drive_delay / PERIOD)
    for column in (target, qd, qdd):
        column[late:] = column[: ticks - late].copy()
    q[:resting], q[resting:] = start, reference[-1]
    q[resting : resting + len(reference)] = reference
    pose = np.zeros((ticks, 6))
    pose[:, 3:] = Rotation.from_matrix(rotation).as_rotvec()
    tick_of = np.arange(ticks, dtype=float)
    return Recording(
        {
            "tick": tick_of, "timestamp": PERIOD * tick_of,
            "reference_q": q, "target_q": target, "target_qd": qd, "target_qdd": qdd,
            "truth_tool_acceleration": force, "truth_flange_pose": pose,
            "shaper_delay": np.full(ticks, delay + cycle.drive_delay),
        }
    )  # fmt: skip


def control_line(
    description: RobotDescription,
    start: Floats,
    declared: Payload,
    carried: Payload,
    plant: Plant | None = None,
) -> ControlCycle:
    """Create a control line from shaped reference to arm, without a shaper.

    Args:
        description: The controller's model of the arm.
        start: Joint angles at which the arm rests, shape (n,) [rad].
        declared: Declared payload.
        carried: Payload that the arm carries.
        plant: Plant to control; None for the arm of the description.
    """
    joints = description.joints
    return ControlCycle(
        description, Unchanged(joints), q=start, declared=declared, carried=carried, seed=0, plant=plant
    )
