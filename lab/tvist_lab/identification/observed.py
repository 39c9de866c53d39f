"""Recorded motions that a twin repeats in simulation, and its response."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from tvist_controller.api.line import DrivenLine, body, respond
from tvist_lab.identification.ring_downs import INEXACT, Log, RingDownStop, noise_of, objection
from tvist_lab.metrics import MotionRows, motions
from tvist_lab.metrics.vibration import SENSOR
from tvist_lab.recordings import Floats, RecordingError
from tvist_lab.recordings.two_clocks import closest_rotation
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Response
from tvist_protocol.values import Payload

AFTER = 0.5  # time after a stop that is compared, if the arm rests that long [s]
BEFORE = 0.1  # time before a stop from which the acceleration is compared [s]
COUNTED_FROM = 0.01  # time after a stop from which the vibration counts as residual [s]
LEAST_AFTER = 0.15  # shortest rest after a stop that can be compared [s]
ANGLE = 3e-4  # accuracy of a simulated joint angle [rad]
TORQUE = 0.01  # accuracy of a simulated torque, relative to the joint's largest one [-]
BLOCK = 10  # number of ticks over which angles and torques are averaged


@dataclass(frozen=True)
class Observed:
    """A motion of a log in ticks of the twin; the reference may first move in tick 0."""

    log: str
    motion: int
    payload: int
    start: Floats  # joint angles at rest before the motion, shape (n,) [rad]
    reference: Floats  # reference, shape (T, n) [rad]
    late: int  # ticks by which an arm of another controller lags behind a twin
    felt: tuple[Floats, Floats, float]
    """Ticks (k,) and specific force (k, 3) near the stop, and the force's inaccuracy [m/s²]."""
    residual: slice  # rows of `felt` in which the vibration counts as residual
    noise: float  # noise of the accelerometer, rms per axis [m/s²]
    angles: tuple[Floats, Floats]
    """Ticks (m,) and measured angles, block means (m, n) [rad]; empty if not recorded."""
    torques: tuple[Floats, Floats]
    """Ticks (m,) and measured torques (m, n) [N m], up to the stop: at rest, friction hides the torque."""
    foreign: bool  # whether another controller moved the arm

    @property
    def ticks(self) -> int:
        """Number of ticks to simulate."""
        return int(self.felt[0][-1]) + 1

    def residual_of(self, force: Floats) -> float:
        """Return the rms vibration after the stop [m/s²] in a specific force of shape (k, 3)."""
        rest = force[self.residual]
        return float(np.sqrt(np.mean(np.sum((rest - rest.mean(axis=0)) ** 2, axis=1))))

    @property
    def measured_residual(self) -> float:
        """Measured rms vibration after the stop, without the noise [m/s²]."""
        return float(np.sqrt(max(self.residual_of(self.felt[1]) ** 2 - 3.0 * self.noise**2, 0.0)))


def observe(logs: Sequence[Log], payloads: Sequence[Payload]) -> tuple[list[Observed], list[RingDownStop]]:
    """Return the motions that a twin can repeat, and the other motions with the reason why it cannot."""
    found, others = [], []
    for log in logs:
        if "target_q" not in log.recording:
            raise RecordingError(
                f"{log.name} has no target_q, from which a twin makes the motions again: record it as well"
            )
        for number, motion in enumerate(motions(log.recording), 1):
            reason = objection(log.recording, motion)
            one = None if reason else _observed(log, number, motion, payloads)
            if one is not None:
                found.append(one)
                continue
            short = f"the arm rested for less than {LEAST_AFTER:g} s"
            others.append(RingDownStop(log.name, number, None, reason or short))
    return found, others


def _observed(log: Log, number: int, motion: MotionRows, payloads: Sequence[Payload]) -> Observed | None:
    recording = log.recording
    time, name = recording.time, "reference_q" if "reference_q" in recording else "target_q"
    begin = time[motion.start]
    stop = motion.arm_stop(recording)
    past = min(int(np.searchsorted(time, time[stop] + AFTER)), motion.end)
    if past - stop < LEAST_AFTER / recording.period:
        return None
    grid = begin + PERIOD * np.arange(1, round((time[motion.reference_stop] - begin) / PERIOD) + 1)
    reference = np.column_stack(
        [np.interp(grid, time[motion.start : past], axis) for axis in recording[name][motion.start : past].T]
    )
    rows = np.arange(motion.start + 1, past)
    ticks = np.round((time[rows] - begin) / PERIOD) - 1.0
    near = (time[rows] >= time[stop] - BEFORE) & np.isfinite(recording[SENSOR][rows]).all(axis=1)
    after = int(np.searchsorted(time[rows[near]], time[stop] + COUNTED_FROM))
    force, noise = recording[SENSOR][rows[near]], noise_of(recording, motion)
    if len(force) - after < 0.5 * LEAST_AFTER / recording.period:
        return None
    rms = float(np.sqrt(np.mean((force[after:] - force[after:].mean(axis=0)) ** 2)))

    def blocks(column: str, past: int) -> tuple[Floats, Floats]:
        own = rows[rows < past]
        if column not in recording or not np.isfinite(recording[column][own]).all():
            return np.empty(0), np.empty((0, recording.joints))
        parts = list(np.array_split(np.arange(len(own)), max(len(own) // BLOCK, 1)))
        return (
            np.array([ticks[part].mean() for part in parts]),
            np.array([recording[column][own[part]].mean(axis=0) for part in parts]),
        )

    return Observed(
        log=log.name,
        motion=number,
        payload=payloads.index(log.carried(motion.shaped_stop)),
        start=recording[name][motion.start],
        reference=reference,
        late=max(round((motion.lag or 0.0) / PERIOD) - 1, 0),
        felt=(ticks[near], force, float(np.hypot(noise, INEXACT * rms))),
        residual=slice(after, None),
        noise=noise,
        angles=blocks("actual_q", past),
        torques=blocks("actual_moment", stop),
        foreign=recording.foreign,
    )


def repeated(robot: RobotDescription, payload: Payload, motion: Observed) -> Response:
    """Return a served robot's response to a motion, without gear ripple, whose phases are unknown."""
    carried = body(payload)
    driven = DrivenLine(robot, carried).drive(motion.start, motion.reference, motion.ticks)
    smooth = replace(robot, drives=replace(robot.drives, gear_error_amplitude=0.0))
    return respond(FlexibleArm(smooth, carried), driven, 0)


def felt_by(response: Response, motion: Observed, mounting: Floats) -> Floats:
    """Return the specific force that the twin's accelerometer would show in the rows of `felt`, shape (k, 3) [m/s²]."""
    ticks = np.maximum(motion.felt[0] - motion.late, 0.0)
    whole = np.arange(len(response.specific_force))
    force = np.column_stack([np.interp(ticks, whole, axis) for axis in response.specific_force.T])
    return np.asarray(force @ mounting.T)


def mounting_of(pairs: Sequence[tuple[Floats, Floats]]) -> Floats:
    """Return the rotation from flange to accelerometer, from simulated and measured forces, shape (3, 3)."""
    return closest_rotation(sum((measured.T @ simulated for simulated, measured in pairs), np.zeros((3, 3))))


def apart(response: Response, motion: Observed, mounting: Floats, torque: Floats) -> Floats:
    """Return the twin's forces, angles and torques minus the measured ones, over inaccuracies, flattened."""
    _, force, inaccuracy = motion.felt
    parts = [((felt_by(response, motion, mounting) - force) / inaccuracy).ravel()]
    own = (response.measured.q, np.full(len(torque), ANGLE)), (response.measured.moment, TORQUE * torque)
    for (ticks, values), (simulated, scale) in zip((motion.angles, motion.torques), own, strict=True):
        if len(ticks):
            whole = np.arange(len(simulated))
            there = np.maximum(ticks - motion.late, 0.0)
            middle = np.column_stack([np.interp(there, whole, axis) for axis in _smooth(simulated).T])
            difference = middle - values
            if (
                values is motion.angles[1]
            ):  # friction may hold the arm off by an unknown angle, and logs may not contain the sag
                difference -= difference[0].copy()
            parts.append((difference / scale).ravel())
    return np.concatenate(parts)


def _smooth(values: Floats) -> Floats:
    """Return moving means over a block, in the shape given."""
    padded = np.pad(values, ((BLOCK // 2, BLOCK - BLOCK // 2), (0, 0)), mode="edge").cumsum(axis=0)
    return np.asarray((padded[BLOCK:] - padded[:-BLOCK]) / BLOCK)
