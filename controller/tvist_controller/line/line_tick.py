"""Figure 6 of the paper from shaped reference to drive commands, as one kernel for speed."""

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats, differentiate
from tvist_controller.line.joint_controllers import command_drives
from tvist_plant.chain import collect_gravity, torques
from tvist_plant.plant import GRAVITY

REFERENCE, Q, QD, QDD, TORQUE, STATIC, Q_R, QD_R, TORQUE_FF, SIGNALS = range(10)
"""Rows of a tick's signals, and their number: newest reference q; target q*, q̇*, q̈* with torque τ*; the
part of τ* that balances gravity; command q_r, q̇_r, τ_ff."""


@compiled_for_ticks
def to_drives(
    before: Floats,  # the three shaped references, shape (n,) [rad]
    middle: Floats,  # q*
    last: Floats,  # that of this tick
    reference: Floats,  # of this tick before shaping
    period: float,
    chain: Floats,  # links of the rigid arm with its declared payload, shape (n+1, 22)
    bodies: Floats,  # scratch, shape (n+1, 28)
    joints: Floats,  # parameters of the joint controllers, shape (19, n); wind-up and stiction are changed
    signals: Floats,  # result, shape (9, n), see `SIGNALS`
) -> None:
    """Compute the drive commands for the middle of three shaped references."""
    rates, torque, static = signals[QD:TORQUE], signals[TORQUE], signals[STATIC]
    for j in range(middle.shape[0]):
        signals[REFERENCE, j], signals[Q, j] = reference[j], middle[j]
    differentiate(before, middle, last, period, rates)
    torques(chain, middle, rates[0], rates[1], GRAVITY, bodies, torque)
    collect_gravity(bodies, GRAVITY, static)
    command_drives(middle, rates, torque, static, joints, signals[Q_R:])


@compiled_for_ticks
def all_to_drives(
    start: Floats,  # shaped reference at rest before them, shape (n,) [rad]
    shaped: Floats,  # of each tick, shape (T, n) [rad]
    period: float,
    chain: Floats,  # for this and the next two see `to_drives`
    bodies: Floats,
    joints: Floats,
    targets: Floats,  # result: q*, q̇* and q̈*, shape (T, 3, n)
    commands: Floats,  # result: q_r, q̇_r and τ_ff, shape (T, 3, n)
) -> None:
    """Compute the drive commands of many ticks from rest, as `to_drives` does."""
    n = start.shape[0]
    signals = np.empty((SIGNALS, n))
    before, middle = start, start
    for k in range(shaped.shape[0]):
        last = shaped[k]
        to_drives(before, middle, last, last, period, chain, bodies, joints, signals)
        for j in range(n):
            targets[k, 0, j], targets[k, 1, j], targets[k, 2, j] = middle[j], signals[QD, j], signals[QDD, j]
            for row in range(3):
                commands[k, row, j] = signals[Q_R + row, j]
        before, middle = middle, last
