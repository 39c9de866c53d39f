"""What the drives of an elastic arm get: motors lead by what is wanted, as far as their torque permits."""

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.friction import friction_at

RECOVERY = 120.0
"""Rate at which the lead returns to the formula after its acceleration was limited, critically damped [1/s]."""


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
def motor_command(
    q: Floats,
    qd: Floats,
    qdd: Floats,
    torque: Floats,
    wanted: Floats,
    led: Floats,
    ticks: int,
    most: Floats,
    least: Floats,
    rotor: Floats,
    friction: Floats,
    width: float,
    linear: bool,
    with_torques: bool,
    period: float,
    law: Floats,
    motors: Floats,
) -> bool:
    """Let the motors lead, and compute what the drives get for the tick before.

    Args:
        q: Target of that tick, shape (n,) [rad].
        qd: Its velocity, shape (n,) [rad/s].
        qdd: Its acceleration, shape (n,) [rad/s^2].
        torque: Torque of arm and rotors for it, shape (n,) [N m].
        wanted: See `follow`.
        led: See `follow`.
        ticks: Number of leads before this one, of which the first three are as wanted.
        most: Torque that motion and lead may need together, shape (n,) [N m].
        least: Torque that the lead may always need, shape (n,) [N m].
        rotor: Rotor inertia, shape (n,) [kg m^2].
        friction: Coulomb friction to feed forward, shape (n,) [N m]; its slope, if it is linear [N m s/rad].
        width: Speed over which friction changes its sign [rad/s].
        linear: Whether friction is linear.
        with_torques: Whether the torques count with the lead.
        period: Tick [s].
        law: Identified friction, see `friction_at`, which then counts instead; shape (0, 0) if there is none.
        motors: Result: positions [rad], velocities [rad/s], accelerations [rad/s^2] and torques [N m] of the motors,
            shape (4, n).

    Returns:
        Whether the lead was limited.
    """
    n, limited = q.shape[0], False
    if ticks < 3:
        for row in range(ticks + 1, 3):
            wanted[row] = wanted[0]
        led[:] = wanted
    else:
        room = np.empty(n)
        for j in range(n):
            room[j] = max(most[j] - abs(torque[j]), least[j]) / rotor[j]
        limited = follow(wanted, led, room, period)
    for j in range(n):
        rise = (led[0, j] - 2.0 * led[1, j] + led[2, j]) / (period * period)
        motors[0, j] = q[j] + led[1, j]
        motors[1, j] = qd[j] + (led[0, j] - led[2, j]) / (2.0 * period)
        motors[2, j] = qdd[j] + rise
        speed = motors[1, j] if with_torques else qd[j]
        if law.shape[0] > 0:
            motors[3, j] = torque[j] + friction_at(law, j, speed)
        else:
            motors[3, j] = torque[j] + friction[j] * (speed if linear else np.tanh(speed / width))
        if with_torques:
            motors[3, j] += rotor[j] * rise
    return limited
