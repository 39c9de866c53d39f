"""Figure 6 of the paper from the shaped reference to the drives' commands, in one compiled function.

The boxes are in their own modules; called one by one from Python, they would take three times as long.
"""

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats, differentiate
from tvist_controller.line.joint_controllers import command_drives
from tvist_plant.chain import collect_gravity, torques
from tvist_plant.plant import GRAVITY

REFERENCE, Q, QD, QDD, TORQUE, STATIC, Q_R, QD_R, TORQUE_FF, SIGNALS = range(10)
"""Rows of the signals of a tick: the newest reference q, the target q*, q̇* and q̈* with its torque τ*, the part of τ*
that balances gravity, and the command q_r, q̇_r and τ_ff; their number.
"""


@compiled_for_ticks
def to_drives(
    before: Floats,
    middle: Floats,
    last: Floats,
    reference: Floats,
    period: float,
    chain: Floats,
    bodies: Floats,
    joints: Floats,
    signals: Floats,
) -> None:
    """Compute the drives' commands for the middle one of three shaped references.

    Args:
        before: First reference, shape (n,) [rad].
        middle: Second reference q*.
        last: Third reference, which is that of this tick.
        reference: Reference of this tick before shaping, shape (n,) [rad].
        period: Tick [s].
        chain: Links of the rigid arm with its declared payload, shape (n+1, 22).
        bodies: Scratch, shape (n+1, 28).
        joints: Parameters of the joint controllers, shape (13, n); their wind-up is changed.
        signals: Result, shape (9, n), see `SIGNALS`.
    """
    rates, torque, static = signals[QD:TORQUE], signals[TORQUE], signals[STATIC]
    for j in range(middle.shape[0]):
        signals[REFERENCE, j], signals[Q, j] = reference[j], middle[j]
    differentiate(before, middle, last, period, rates)
    torques(chain, middle, rates[0], rates[1], GRAVITY, bodies, torque)
    collect_gravity(bodies, GRAVITY, static)
    command_drives(middle, rates, torque, static, joints, signals[Q_R:])


@compiled_for_ticks
def all_to_drives(
    start: Floats,
    shaped: Floats,
    period: float,
    chain: Floats,
    bodies: Floats,
    joints: Floats,
    targets: Floats,
    commands: Floats,
) -> None:
    """Compute the drives' commands for many ticks, one by one as `to_drives` does, from rest.

    Args:
        start: Shaped reference at rest before them, shape (n,) [rad].
        shaped: Shaped reference of each tick, shape (T, n) [rad].
        period: See `to_drives`, as for the next two.
        chain: Links.
        bodies: Scratch.
        joints: Parameters of the joint controllers.
        targets: Result: q*, q̇* and q̈*, shape (T, 3, n).
        commands: Result: q_r, q̇_r and τ_ff, shape (T, 3, n).
    """
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
