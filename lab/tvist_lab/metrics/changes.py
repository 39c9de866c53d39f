"""Find the motions of a recording after which the arm's payload, gears or modes have changed."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial

import numpy as np

from tvist_lab.metrics.change_detector import SHOWN, ChangeDetector, DetectedChange
from tvist_lab.metrics.frequency_factor import FrequencyFactorEstimator
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.ring_down import CERTAIN
from tvist_lab.metrics.table import MeasuredRecording, MotionResult
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription, load, robots
from tvist_plant.model import carries_weight, holding_torque, rigid_model
from tvist_plant.plant import PERIOD

NEEDED = ("target_q", "actual_q", "actual_moment", "target_moment", "actual_tool_accelerometer")
"""Columns needed to compare the arm of a recording with itself."""
SAME = 0.1  # largest difference of any joint between two poses that count as one [rad]
SCATTER, LEAST = 0.015, 0.04
"""Expected deviation of the logarithm of f_d after stops in one pose, and its smallest reported change [-]."""
LISTENED = 150  # ticks after a stop in which the vibration is measured
SHORTEST = 100  # smallest number of these ticks, if the next motion starts sooner
SETTLED = 50  # number of last ticks among them in which the gears' deflection is measured
FRICTION = 0.2  # standard deviation of torques at rest due to friction, relative to Coulomb friction [-]
OFF = 1e-4  # standard deviation of angles at rest, due to gear errors and integrators [rad]
VAGUE = 0.25  # relative error from which a gear's compliance counts as unknown in a pose [-]
HEAVY = 0.7  # error of a mass from which the mass found after a motion is ignored [kg]
MASS, GEAR, MODES = (1.0, 0.15, 0.7), (0.4, 0.05, 0.15), (0.1, 0.02, 0.03)
"""Detectors' prior, expected scatter and least reported change: mass [kg], logarithms of gears and modes."""
UNKNOWN = 0.4  # share of Coulomb friction that may be unknown in each joint, with the worst sign [-]


def changes(measured: MeasuredRecording) -> list[str]:
    """Return sentences on what has changed about the arm, in the order of the motions.

    In a recording of this controller, the arm is compared with its model, see `FitMonitor`. In a log of another robot,
    masses are unknown: the strongest mode after each stop is compared with earlier ones in the same pose.
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
    """Return the robot file of a model that comes with the package; None if there is none."""
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
        gaps = np.any(np.diff(recording["tick"][motion.shaped_stop : motion.end]) != 1.0)
        if gaps or rest.stop - first < SHORTEST:
            continue
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


class FitMonitor:
    """Measures after each stop whether the arm has changed; see `ChangeDetector`.

    Each quantity is compared with its own past, so that wrong torque constants or springs do not matter: the mass that
    the drives feel beyond the declared one; the logarithm of each gear's deflection per torque at rest, if encoders
    are on the link side; and the logarithm of the `FrequencyFactorEstimator`'s factor on the robot file's modes.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._names = description.robot.joints
        self._friction = np.array(description.drives.coulomb_friction)
        # Without this floor, a joint without friction would dominate the estimate of the mass.
        self._unsure = np.maximum(self._friction, 0.01 * np.array(description.limits.torque))
        self._stiffness = np.array(description.drives.gear_stiffness)
        self._weighs = carries_weight(description)
        self._arm = rigid_model(description, Payload())
        self._loaded = rigid_model(description, Payload(mass=1.0, com=payload.com))
        self._frequency_factor = FrequencyFactorEstimator(description, payload)
        self._mass, self._modes = ChangeDetector(*MASS), ChangeDetector(*MODES)
        self._gears = [ChangeDetector(*GEAR) for _ in range(description.joints)]

    def stop(
        self, target: Floats, q: Floats, moment: Floats, expected: Floats, alpha: Floats
    ) -> Iterator[str]:
        """Measure after a stop, and yield a clause for each change; mostly none.

        `target` [rad] has shape (n,). From the stop on, `q` [rad], `moment` and `expected` (from
        feed-forward) [N m] have shape (T, n), `alpha` (of the accelerometer) [m/s²] (T, 3).
        """
        if self._weighs:
            excess, bound = self._felt(target, (moment - expected).mean(axis=0))
            if bound < 2.0 * HEAVY:
                yield from _told(self._mass.take(excess, 0.5 * bound), _of_mass)
        torque, twist = moment[-SETTLED:].mean(axis=0), (target - q[-SETTLED:]).mean(axis=0)
        for joint, detector in enumerate(self._gears):
            if twist[joint] * torque[joint] <= 0.0:
                continue
            error = float(np.hypot(FRICTION * self._friction[joint] / torque[joint], OFF / twist[joint]))
            if error < VAGUE:
                softer = float(np.log(twist[joint] * self._stiffness[joint] / torque[joint]))
                yield from _told(detector.take(softer, error), partial(_of_gear, joint=self._names[joint]))
        for u, error in self._frequency_factor.estimate(alpha, q[-1]):
            yield from _told(self._modes.take(u, error), _of_modes)

    def _felt(self, q: Floats, feedback: Floats) -> tuple[float, float]:
        """Return the mass explaining drives' feedback at rest, and its largest error due to friction [kg]."""
        per_kg = holding_torque(self._loaded, q) - holding_torque(self._arm, q)
        weighted = per_kg / self._unsure**2
        square = float(weighted @ per_kg)
        if square <= 0.0:
            return 0.0, math.inf
        return float(weighted @ feedback) / square, UNKNOWN * float(np.abs(weighted) @ self._unsure) / square


def _told(change: DetectedChange | None, why: Callable[[DetectedChange], str]) -> list[str]:
    return [] if change is None else [why(change)]


def _of_mass(change: DetectedChange) -> str:
    more = change.after - change.before
    return (
        f"the arm carries about {abs(more):.1f} kg {'more' if more > 0.0 else 'less'} than in the motions before "
        f"(within {SHOWN * change.error:.1f} kg), and nobody has declared it: declare the payload with set_payload, or "
        "find out what pushes the arm"
    )


def _of_gear(change: DetectedChange, joint: str) -> str:
    size, within = _percent(change.before - change.after, change.error)
    return (
        f"the gear of the {joint} is {size:.0f} % {'softer' if change.after > change.before else 'stiffer'} than in "
        f"the motions before (within {within:.0f} %), by the angle that it gives way at rest: look for a "
        "loose or worn joint, then measure the arm anew with tvist identify"
    )


def _of_modes(change: DetectedChange) -> str:
    size, within = _percent(change.after - change.before, change.error)
    return (
        f"what rings after stops is {size:.0f} % {'higher' if change.after > change.before else 'lower'} in frequency "
        f"than after the stops before (within {within:.0f} %): look whether mount, base, a joint or the tool "
        "is loose or another tool is on, then measure the arm anew with tvist identify"
    )


def _percent(logarithm: float, error: float) -> tuple[float, float]:
    """Return the size of a change given by its logarithm, and the distance to its interval's nearer end [%]."""
    nearer = math.copysign(abs(logarithm) - SHOWN * error, logarithm)
    return 100.0 * abs(math.expm1(logarithm)), 100.0 * abs(math.exp(logarithm) - math.exp(nearer))
