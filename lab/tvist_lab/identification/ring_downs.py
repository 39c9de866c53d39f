"""Measurement of ring-downs: make the arm vibrate at a configuration and record it."""

from collections.abc import Awaitable
from dataclasses import asdict, dataclass
from typing import TypeVar

import numpy as np

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import MotionLimits
from tvist_lab.collect import collect
from tvist_lab.metrics import RingDown, fit_ring_down, motions, tool_acceleration
from tvist_lab.recordings import Floats, RecordingError
from tvist_protocol.errors import RefusedError

Measured = TypeVar("Measured")

LISTEN = 0.6
"""Time recorded after a jog [s]."""
PAUSE = 0.3
"""Rest before the next jog [s]."""
MODES = 2
"""Number of modes that are fitted together."""
SKIPPED = 7
"""Ticks after the stop that a `Ringing` leaves out, since the end of the deceleration ramp is not a ring-down."""
SAMPLES = 200
"""Number of ticks in a `Ringing`."""
QUIET = 75
"""Number of ticks before a jog from which the noise is determined."""
LEAST_NOISE = 0.01
"""Smallest assumed noise [m/s^2], since no model is more accurate than that."""
SHARE = 0.25
"""The first mode is the lowest one whose amplitude is at least this share of the largest [-]."""


@dataclass(frozen=True)
class Jog:
    """A short move to the configuration of interest, with all big joints at once, so that it excites every mode."""

    length: float = 0.06
    """Length of the jog for the fastest joint [rad]."""
    shares: tuple[float, ...] = (0.6, 0.6, 1.0)
    """Shares of the joints, from the base on [-]."""
    quickness: float = 1.0
    """Factor of the velocity; acceleration and jerk grow with its square and cube [-]."""

    @property
    def limits(self) -> MotionLimits:
        """Return the limits of the jog: those of a client's `move_j`, and quicker ones for an arm that needs them."""
        quick = self.quickness
        return MotionLimits(velocity=1.5 * quick, acceleration=2.0 * quick**2, jerk=100.0 * quick**3)

    def of(self, joints: int) -> Floats:
        """Return the displacement of the joints, shape (joints,) [rad]."""
        jog = np.zeros(joints)
        used = min(joints, len(self.shares))
        jog[:used] = self.length * np.array(self.shares[:used])
        return jog


@dataclass(frozen=True)
class Ringing:
    """Acceleration of the tool at a configuration after a jog."""

    q: Floats
    """Configuration, shape (n,) [rad]."""
    payload: int
    """Index of the carried payload."""
    force: Floats
    """Specific force, beginning shortly after the stop, shape (T, 3) [m/s^2]."""
    noise: float
    """Noise of the force at rest, rms per axis [m/s^2]."""
    time: Floats | None = None
    """Times of the samples from the first on, shape (T,) [s]; None for one in each control period."""
    inexact: float = 0.0
    """What a linear model may leave of it beside the noise, rms per axis [m/s^2]."""
    driven: tuple[complex, ...] = ()
    """Poles with which the set-point still comes to rest, one of each pair [1/s]; empty if it rests."""
    softening: float = 0.0
    """Share by which the gears' hysteresis softens the springs, over the tool's amplitude [1/m]."""

    @property
    def rms(self) -> float:
        """Return the rms of the force without its mean, per axis [m/s^2]."""
        return float(np.sqrt(np.mean((self.force - self.force.mean(axis=0)) ** 2)))


async def or_none(measuring: Awaitable[Measured]) -> Measured | None:
    """Wait for a motion or a measurement; return None if the robot refuses it because of a collision."""
    try:
        return await measuring
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None


async def reach(arm: Arm, q: Floats) -> None:
    """Move to a configuration; if there would be a collision on the straight line, via the upright arm.

    Raises:
        RefusedError: That way is not clear either; code `collision`.
    """
    if await or_none(arm.move_j(q)) is None:
        upright = np.zeros_like(q)
        upright[[joint for joint in (1, 3) if joint < len(q)]] = -np.pi / 2
        await arm.move_j(upright)
        await arm.move_j(q)


async def measure(robot: Robot, arm: Arm, q: Floats, jog: Jog, repeats: int) -> RingDown:
    """Measure (f_d, ζ) of the strongest mode after a jog to a configuration.

    Equal jogs give equal vibrations, so their accelerations are averaged before the fit.

    Args:
        robot: The robot.
        arm: Control of the robot; its shaper must be `none`.
        q: Configuration, shape (n,) [rad].
        jog: The move that excites the arm.
        repeats: Number of jogs to average.

    Raises:
        RefusedError: The configuration cannot be reached; code `collision`.
    """
    start = q - jog.of(len(q))
    await reach(arm, start)
    period = 1.0 / (await robot.info()).rate_hz
    rings = []
    for _ in range(repeats):
        await arm.move_j(start)
        await robot.advance(round(PAUSE / period))
        with collect(robot) as collected:
            await robot.advance(1)
            await arm.move_j(q, **asdict(jog.limits))
            await robot.advance(round(LISTEN / period))
        recording = collected.recording()
        stop = motions(recording)[0].shaped_stop
        rings.append(tool_acceleration(recording)[stop : stop + round(LISTEN / period)])
    length = min(map(len, rings))
    return fit_ring_down(np.mean([ring[:length] for ring in rings], axis=0), period, modes=MODES, share=SHARE)


async def listen(robot: Robot, arm: Arm, q: Floats, payload: int, jog: Jog) -> Ringing:
    """Jog to a configuration once, and record the ring-down.

    Args:
        robot: The robot.
        arm: Control of the robot; its shaper must be `none`.
        q: Configuration, shape (n,) [rad].
        payload: Index of the carried payload, for the result.
        jog: The move that excites the arm.

    Raises:
        RefusedError: The configuration cannot be reached; code `collision`.
        RecordingError: States were lost.
    """
    start = q - jog.of(len(q))
    await reach(arm, start)
    period = 1.0 / (await robot.info()).rate_hz
    with collect(robot) as collected:
        await robot.advance(round(PAUSE / period))
        await arm.move_j(q, **asdict(jog.limits))
        await robot.advance(SKIPPED + SAMPLES + 50)
    recording = collected.recording()
    if recording.missing_ticks:
        raise RecordingError(
            f"{recording.missing_ticks} states were lost: the connection to the robot is too slow"
        )
    force = recording["actual_tool_accelerometer"]
    moved = motions(recording)[-1]
    first = moved.shaped_stop + SKIPPED
    before = force[max(moved.start - QUIET, 0) : moved.start]
    noise = float(np.sqrt(np.mean((before - before.mean(axis=0)) ** 2)))
    return Ringing(q, payload, force[first : first + SAMPLES], max(noise, LEAST_NOISE))
