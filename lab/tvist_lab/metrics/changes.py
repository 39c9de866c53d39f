"""From which motion of a recording on the arm was no longer the one of the motions before."""

import math
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from tvist_lab.metrics.change_detector import ChangeDetector
from tvist_lab.metrics.fit_monitor import LISTENED, SHORTEST, FitMonitor
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.ring_down import CERTAIN
from tvist_lab.metrics.table import Measured, MotionResult
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription, load, robots
from tvist_plant.plant import PERIOD

NEEDED = ("target_q", "actual_q", "actual_moment", "target_moment", "actual_tool_accelerometer")
"""Columns by which the arm of a recording is compared with itself."""
SAME = 0.1
"""Largest difference of any joint between two poses that count as one [rad]."""
SCATTER, LEAST = 0.015, 0.04
"""Expected deviation of the logarithm of f_d after stops in one pose, and its least change that is told [-]."""


def changes(measured: Measured) -> list[str]:
    """Return what has changed about the arm, a sentence each, in the order of the motions.

    In a recording of this controller the arm is compared with its model, see `FitMonitor`. Of a log of another one the
    masses are not known: there the strongest mode after each stop is compared with those before in the same pose.
    """
    if not measured.motions:
        return []
    recording = measured.recording
    description = None if recording.info is None or recording.foreign else _described(recording.info.model)
    if (
        description is not None
        and all(name in recording for name in NEEDED)
        and description.joints == recording.joints
        and abs(recording.period - PERIOD) < 1e-6
    ):
        return list(_by_model(recording, measured.motions, description))
    return list(_by_pose(recording, measured.motions, measured.results))


@cache
def _described(model: str) -> RobotDescription | None:
    """Robot file of a model that comes with the package; None if there is none."""
    return next((one for one in map(load, robots()) if one.robot.model == model), None)


def _by_model(
    recording: Recording, found: Sequence[MotionRows], description: RobotDescription
) -> Iterator[str]:
    said = recording.info.payload
    arm = FitMonitor(description, Payload(mass=said.mass, com=said.com, inertia=said.inertia))
    target, *measured = (recording[name] for name in NEEDED)
    for number, motion in enumerate(found, 1):
        first = motion.shaped_stop + 1
        rest = slice(first, min(motion.end, first + LISTENED))
        if rest.stop - first < SHORTEST:
            continue
        if np.any(np.diff(recording["tick"][motion.shaped_stop : motion.end]) != 1.0):
            continue  # of a rest with gaps nothing is known
        changed = arm.stop(target[rest.stop - 1], *(column[rest] for column in measured))
        yield from (f"After motion {number}, {why}." for why in changed)


def _by_pose(
    recording: Recording, found: Sequence[MotionRows], results: Sequence[MotionResult]
) -> Iterator[str]:
    poses: list[tuple[Floats, ChangeDetector]] = []
    for number, (motion, result) in enumerate(zip(found, results, strict=True), 1):
        if result.f_d_hz is None or result.f_d_interval_hz is None or "actual_q" not in recording:
            continue
        q = recording["actual_q"][motion.end - 1]
        known = next((one for pose, one in poses if np.max(np.abs(pose - q)) < SAME), None)
        if known is None:
            known = ChangeDetector(10.0, SCATTER, LEAST)
            poses.append((q, known))
        low, high = result.f_d_interval_hz
        change = known.take(math.log(result.f_d_hz), (high - low) / (2.0 * CERTAIN * result.f_d_hz))
        if change is not None:
            yield (
                f"After motion {number}, {math.exp(change.after):.1f} Hz ring after the last {change.lasting} stops in "
                f"this pose, and {math.exp(change.before):.1f} Hz did before: look whether mount, base, a joint or the "
                "tool is loose, or whether another tool is on."
            )
