"""Identify each joint's friction from speed and torque in a slow motion there and back.

The way back is the way there reversed in time. Weight and inertia need the same torque on both ways, friction
needs opposite torques. So half the difference of the torques is friction alone, whatever the masses:

    (τ_there(t) - τ_back(T - t)) / 2 = F(v),  F(v) = [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w) + F_v v

(Stribeck curve; Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30, 1994.)
"""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from scipy.optimize import least_squares, nnls

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import MotionLimits
from tvist_lab.collect import collect
from tvist_lab.identification.ring_downs import IdentificationError
from tvist_lab.identification.travel import Travel, unless_collision
from tvist_lab.identification.unknowns import Unknown, parameter
from tvist_lab.metrics import motions
from tvist_lab.metrics.ring_down import widening
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import ModalParameter

LENGTH = 0.45  # length of the way, of every joint [rad]
LIMITS = MotionLimits(velocity=0.3, acceleration=0.2, jerk=100.0)
"""Limits of the motion: slow enough for many samples near standstill, quick enough for viscous friction."""
REST = 0.3  # rest before the way there and back [s]
PLACES = 8  # number of configurations tried for a free way
BLOCK = 10  # number of ticks over which speeds and torques are averaged
SETTLING = 2  # number of blocks left out at both ends, where friction still depends on the earlier motion
GROWTH = (0, 1, 4)  # powers of the speed with which the noise grows, since the gears' ripple grows with speed
LEAST_NOISE = 0.003  # smallest assumed noise, relative to the joint's friction [-]
ROUNDS = 4  # number of fits, each weighted with the residuals of the one before
LEAST_BREAKAWAY = 1.0  # smallest ratio of friction at breakaway to that in motion [-]


def unknown_friction(description: RobotDescription) -> tuple[tuple[Unknown, ...], ...]:
    """Return the parameters of each joint's friction before a measurement."""
    return tuple(
        (
            Unknown("coulomb_friction", (joint,), 0.04 * torque, 1.0),
            Unknown("breakaway", (joint,), 1.2, 0.3),
            Unknown("stribeck_speed", (joint,), 0.05, 0.7),
            Unknown("friction_width", (joint,), 0.05, 1.0),
            Unknown("viscous_friction", (joint,), 0.02 * torque, 1.0),
        )
        for joint, torque in enumerate(description.limits.torque)
    )


async def identify_friction(
    robot: Robot, control: Arm, description: RobotDescription, places: Sequence[Floats]
) -> tuple[ModalParameter, ...]:
    """Move all joints slowly there and back, and fit the friction of each."""
    speed, torque = there_and_back(await _sweep(robot, control, description, places))
    return tuple(
        parameter
        for joint, unknown in enumerate(unknown_friction(description))
        for parameter in fit_friction(unknown, speed[:, joint], torque[:, joint])
    )


async def _sweep(
    robot: Robot, control: Arm, description: RobotDescription, places: Sequence[Floats]
) -> Recording:
    """Record the way there and back around the first of `places` where the way is free of collision."""
    info = await robot.info()
    period, travel = 1.0 / info.rate_hz, Travel(robot, control, description, info.payload)
    for middle in places[:PLACES]:
        for side in (0.5 * LENGTH, -0.5 * LENGTH):
            if await unless_collision(travel.reach(middle - side)) is None:
                continue
            with collect(robot) as collected:
                await robot.advance(round(REST / period))
                if await unless_collision(control.move_j(middle + side, **asdict(LIMITS))) is None:
                    continue
                await robot.advance(round(REST / period))
                await control.move_j(middle - side, **asdict(LIMITS))
                await robot.advance(BLOCK)
            return collected.recording()
    raise IdentificationError(
        f"no path of {LENGTH:g} rad of all joints is free of collisions to measure friction: give the arm more room"
    )


def there_and_back(recording: Recording) -> tuple[Floats, Floats]:
    """Return speeds [rad/s] and friction torques [N m], from both ways, as block means of shape (k, n)."""
    there, back = motions(recording)[-2:]
    length = min(there.shaped_stop - there.start, back.shaped_stop - back.start)

    def odd(name: str) -> Floats:
        column = recording[name]
        one = column[there.start : there.start + length]
        other = column[back.start : back.start + length][::-1]
        blocks = length // BLOCK
        mean = (0.5 * (one - other))[: blocks * BLOCK].reshape(blocks, BLOCK, -1).mean(axis=1)
        return np.asarray(mean[SETTLING:-SETTLING])

    return odd("actual_qd"), odd("actual_moment")


def friction(logarithms: Floats, speed: Floats) -> Floats:
    """Return F(v) for the logarithms of F_c, F_s/F_c, v_s, w and F_v, in the shape of v [N m]."""
    coulomb, breakaway, stribeck, width, viscous = np.exp(logarithms)
    shape = 1.0 + (breakaway - 1.0) * np.exp(-((speed / stribeck) ** 2))
    return np.asarray(coulomb * shape * np.tanh(speed / width) + viscous * speed)


def fit_friction(unknown: Sequence[Unknown], speed: Floats, torque: Floats) -> tuple[ModalParameter, ...]:
    """Fit the friction of one joint to speeds [rad/s] and torques [N m] of shape (k,)."""
    # Ripple of the gears makes noise that grows with speed, so each block has its own weight. This noise is
    # correlated from block to block, so the intervals are widened.
    guess = np.log([one.guess for one in unknown])
    deviation = np.array([one.deviation for one in unknown])
    low = np.full(len(guess), -np.inf)
    low[1] = np.log(LEAST_BREAKAWAY) - 1e-9
    growing = (np.abs(speed) / np.abs(speed).max())[:, None] ** GROWTH
    least = LEAST_NOISE * max(float(np.abs(torque).max()), 1e-6)
    noise, found, left = np.full(len(speed), max(float(torque.std()), least)), guess, torque
    for _ in range(ROUNDS):

        def residual(logarithms: Floats, noise: Floats = noise) -> Floats:
            short = (friction(logarithms, speed) - torque) / noise
            return np.concatenate([short, (logarithms - guess) / deviation])

        fit = least_squares(residual, found, bounds=(low, np.inf), x_scale=0.1)
        found, left = fit.x, friction(fit.x, speed) - torque
        noise = np.maximum(growing @ nnls(growing, np.abs(left))[0] * np.sqrt(0.5 * np.pi), least)
    jacobian = fit.jac[: len(speed)]
    white = left / noise
    wider = widening(white, len(guess)) ** 2 * max(float(np.mean(white**2)), 1.0)
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian / wider + np.diag(deviation**-2))))
    return tuple(map(parameter, unknown, np.exp(found).tolist(), errors.tolist()))
