"""Signals of the control line in a tick, and the kernels from shaped reference to drive commands."""

import numpy as np
from msgspec import Struct

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats, Target, differentiate
from tvist_controller.line.joint_controllers import command_drives
from tvist_controller.line.line_mode import LineMode, Obstacle
from tvist_plant.chain import collect_gravity, torques
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import GRAVITY, Measurement

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


class MotorReference(Struct, frozen=True, eq=False, gc=False):
    """Motion of the motors that elastic feed-forward commands."""

    rows: Floats  # velocity q̇* + ẇ [rad/s], acceleration q̈* + ẅ [rad/s^2] and torque [N m], shape (3, n)
    limited: bool  # whether ẅ was limited to the drives' remaining torque


class Sample(Struct, frozen=True, eq=False, gc=False):
    """Signals along the control line in one tick."""

    mode: LineMode  # mode of the line
    reference: Floats  # q before shaping, shape (n,) [rad]
    references: tuple[Floats, Floats, Floats]
    """The last three references before shaping, see `ShapedReference`."""
    window: tuple[Floats, Floats, Floats]
    """The last three shaped references, newest last, each of shape (n,) [rad]."""
    signals: Floats  # all signals before the arm, shape (9, n), see `line_tick`
    command: DriveCommand  # command to the drives
    measured: Measurement  # measurement of the arm
    motors: MotorReference | None = None  # motor motion of elastic feed-forward; None without it
    refused: Obstacle | None = None
    """Reason for a stop instead of the reference; None if the reference was played."""

    external: Floats | None = None
    """Reading of a user's force sensor that replaces the arm's own, see `wrench`; None without one."""

    @property
    def wrench(self) -> Floats | None:
        """Force and torque at the flange from the sensor in use, shape (6,) [N, N m]; None without one."""
        return self.measured.wrench if self.external is None else self.external

    @property
    def target(self) -> Target:
        """q* and its derivatives at the previous tick, due to central differences."""
        return Target(self.signals[Q], self.signals[QD], self.signals[QDD])

    @property
    def unshaped(self) -> tuple[Floats, Floats, Floats] | None:
        """Unshaped references around the target's tick; None if equal to the shaped ones to the bit."""
        references, shaped = self.references, self.window
        if references is shaped:
            return None
        for k in (2, 1, 0):  # comparing bytes is several times as fast as comparing arrays
            if references[k].tobytes() != shaped[k].tobytes():
                return references
        return None
