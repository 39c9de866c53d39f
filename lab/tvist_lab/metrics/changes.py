"""From which motion of a recording on the arm was no longer the one of the motions before."""

import math
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from tvist_controller.api.monitor import (
    SIGNALS,
    ChangeDetector,
    FitMonitor,
    LineMode,
    PayloadMonitor,
    Q,
    Sample,
)
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.ring_down import CERTAIN
from tvist_lab.metrics.table import Measured, MotionResult
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription, load, robots
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Measurement

NEEDED = ("target_q", "actual_q", "actual_moment", "target_moment", "actual_tool_accelerometer")
"""Columns by which a recording is judged as the robot judges itself."""
SAME = 0.1
"""Largest difference of any joint between two poses that count as one [rad]."""
SCATTER, LEAST = 0.015, 0.04
"""Expected deviation of the logarithm of f_d after stops in one pose, and its least change that is told [-]."""


def changes(measured: Measured) -> list[str]:
    """Return what has changed about the arm, a sentence each, in the order of the motions.

    A recording of this controller is judged as the robot judges itself, see `FitMonitor`. Of a log of another one the
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
        return list(_as_the_robot(recording, measured.motions, description))
    return list(_by_pose(recording, measured.motions, measured.results))


@cache
def _described(model: str) -> RobotDescription | None:
    """Robot file of a model that comes with the package; None if there is none."""
    return next((one for one in map(load, robots()) if one.robot.model == model), None)


def _as_the_robot(
    recording: Recording, found: Sequence[MotionRows], description: RobotDescription
) -> Iterator[str]:
    said = recording.info.payload
    payload = Payload(mass=said.mass, com=said.com, inertia=said.inertia)
    felt, fit = PayloadMonitor(description, payload), FitMonitor(description, None, payload)
    names = {name: recording[name] for name in NEEDED}
    still, signals = np.zeros(description.joints), np.zeros((SIGNALS, description.joints))

    def tick(row: int, mode: LineMode) -> list[str]:
        q, moment = names["actual_q"][row], names["actual_moment"][row]
        signals[Q] = names["target_q"][row]
        if mode.at_rest:
            felt.update(signals, names["target_moment"][row], moment, at_rest=True)
        sample = Sample(
            mode, signals[Q], (q, q, q), (q, q, q), signals, DriveCommand(signals[Q].copy(), still, still),
            Measurement(q, still, moment, names["actual_tool_accelerometer"][row]),
        )  # fmt: skip
        return [why for _, why in fit.update(sample, felt.of_motion)]

    for number, motion in enumerate(found, 1):
        last = number - 1
        said_in = tick(motion.start + 1, LineMode.SHAPED)
        felt.begin_motion()
        yield from (f"After motion {last}, {why}." for why in said_in)
        if np.any(np.diff(recording["tick"][motion.shaped_stop : motion.end]) != 1.0):
            fit.reset()  # of a rest with gaps nothing is known
            continue
        for row in range(motion.shaped_stop + 1, motion.end):
            yield from (f"After motion {number}, {why}." for why in tick(row, LineMode.REST))


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
