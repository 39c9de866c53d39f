"""By how much motors have to lead so that an elastic arm follows its target, and the limit of that.

A gear that transmits a load τ without gravity twists by τ/K_g, and a link that carries one bends by φ = -τ_f/k_b. Both
lag by the damping time D/K, a fraction of a tick. The joints have to turn by the twist, and by what moves the flange
back by as much as the bending has moved it:

    w = τ/K_g + J_jᵀ (J_j J_jᵀ + λ² E)⁻¹ (-J_f φ)

J_j and J_f are the flange's translation Jacobians with respect to joints and bending. λ keeps w small near singular
postures, where joints would have to turn far to move the flange a little (Nakamura and Hanafusa, 1986).
"""

import numpy as np
import numpy.typing as npt

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.friction import friction_at
from tvist_controller.quiet.elimination import eliminate

Integers = npt.NDArray[np.int64]

DAMPED = 0.1
"""λ, in the order of the lever arms that may be taken for none [m]."""
RECOVERY = 120.0
"""Rate at which the lead returns to the formula after its acceleration was limited, critically damped [1/s]."""


@compiled_for_ticks
def wanted_lead(
    load: Floats,
    jacobian: Floats,
    joints: Integers,
    flexes: Integers,
    stiffness: Floats,
    late: Floats,
    before: Floats,
    lead: Floats,
) -> None:
    """Compute w.

    Args:
        load: Torques on the springs without gravity, shape (N,) [N m].
        jacobian: Translation and rotation of the flange, shape (6, N) [m/rad].
        joints: Indices of the n joints, shape (n,).
        flexes: Indices of the bending, shape (m,).
        stiffness: Stiffness of each spring, shape (N,) [N m/rad].
        late: Damping time divided by the tick, shape (N,) [-].
        before: Deflections without damping of the tick before, replaced by the present ones, shape (N,) [rad].
        lead: Result, shape (n,) [rad].
    """
    n, m = joints.shape[0], flexes.shape[0]
    moved = np.zeros(3)
    for k in range(m):
        c = flexes[k]
        own = -load[c] / stiffness[c]
        bent = own + late[c] * (before[c] - own)
        before[c] = own
        for row in range(3):
            moved[row] -= jacobian[row, c] * bent
    if m > 0:
        square = np.zeros((3, 3))
        for row in range(3):
            square[row, row] = DAMPED * DAMPED
            for column in range(3):
                for j in range(n):
                    square[row, column] += jacobian[row, joints[j]] * jacobian[column, joints[j]]
        eliminate(square, moved)
    for j in range(n):
        c = joints[j]
        own = load[c] / stiffness[c]
        lead[j] = own + late[c] * (before[c] - own)
        before[c] = own
        for row in range(3):
            lead[j] += jacobian[row, c] * moved[row]


@compiled_for_ticks
def follow(wanted: Floats, led: Floats, room: Floats, period: float) -> bool:
    """Advance the lead by one tick: to what is wanted, with at most a given acceleration.

    Where the acceleration was limited, the lead returns to what is wanted like a critically damped oscillator.

    Args:
        wanted: What is wanted at this tick and the two before, the newest first, shape (3, n) [rad].
        led: Leads of the last three ticks, the newest first; moved on by one, shape (3, n) [rad].
        room: Largest acceleration of each joint's lead, shape (n,) [rad/s^2].
        period: Tick [s].

    Returns:
        Whether an acceleration was limited.
    """
    limited = False
    for j in range(led.shape[1]):
        now, before = led[0, j], led[1, j]
        away = now - wanted[1, j]
        drift = (away - before + wanted[2, j]) / period
        acceleration = (wanted[0, j] - 2.0 * wanted[1, j] + wanted[2, j]) / (period * period)
        acceleration -= RECOVERY * (RECOVERY * away + 2.0 * drift)
        if abs(acceleration) > room[j]:
            limited = True
            acceleration = room[j] if acceleration > 0.0 else -room[j]
        led[2, j], led[1, j] = before, now
        led[0, j] = 2.0 * now - before + period * period * acceleration
    return limited


@compiled_for_ticks
def motor_reference(
    q: Floats,
    qd: Floats,
    torque: Floats,
    led: Floats,
    rotor: Floats,
    friction: Floats,
    width: float,
    linear: bool,
    torques: bool,
    period: float,
    law: Floats,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what the drives get for the tick between the newest lead and the one before the last.

    Args:
        q: Target of that tick, shape (n,) [rad].
        qd: Its velocity, shape (n,) [rad/s].
        torque: Torque of arm and rotors for it, shape (n,) [N m].
        led: Leads, the newest first, shape (3, n) [rad].
        rotor: Rotor inertia, shape (n,) [kg m^2].
        friction: Coulomb friction to feed forward, shape (n,) [N m]; its slope, if it is linear [N m s/rad].
        width: Speed over which friction changes its sign [rad/s].
        linear: Whether friction is linear.
        torques: Whether the torques count with the lead.
        period: Tick [s].
        law: Identified friction, see `friction_at`, which then counts instead; shape (0, 0) if there is none.

    Returns:
        Positions [rad], velocities [rad/s] and torques [N m] of the motors, and accelerations of the lead [rad/s^2],
        each of shape (n,).
    """
    n = q.shape[0]
    motor_q, motor_qd, motor_torque, acceleration = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for j in range(n):
        motor_q[j] = q[j] + led[1, j]
        motor_qd[j] = qd[j] + (led[0, j] - led[2, j]) / (2.0 * period)
        acceleration[j] = (led[0, j] - 2.0 * led[1, j] + led[2, j]) / (period * period)
        speed = motor_qd[j] if torques else qd[j]
        if law.shape[0] > 0:
            motor_torque[j] = torque[j] + friction_at(law, j, speed)
        else:
            motor_torque[j] = torque[j] + friction[j] * (speed if linear else np.tanh(speed / width))
        if torques:
            motor_torque[j] += rotor[j] * acceleration[j]
    return motor_q, motor_qd, motor_torque, acceleration
