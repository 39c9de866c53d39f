"""Dahl's friction, and the stiction of a motor that hardly turns."""

import math

from tvist_plant._compiled import compiled

LEAST = 1e-9
"""Torque that is left of the stiction of a fast motor, so that nothing is divided by zero [N m]."""


@compiled
def relaxed(z: float, way: float, stiffness: float, most: float) -> float:
    """Dahl's friction z after a further way in one direction: the exact solution of its equation.

    A way is an angle if z is a torque. Source: P. Dahl, A solid friction model, 1968: dz/dx = k (1 - z sgn(ẋ)/most).
    """
    end = most if way > 0.0 else -most
    return float(end + (z - end) * math.exp(-stiffness * abs(way) / most))


@compiled
def stiction_after(
    d: float,  # before [N m]
    way: float,  # by which the motor turns [rad]
    speed: float,  # at which it does [rad/s]
    load: float,  # torque in its gear [N m]
    stiction: float,  # F_s [N m]
    stiction_load: float,  # μ_s [-]
    stiction_speed: float,  # v_s [rad/s]
    stiffness: float,  # σ K_g [N m/rad]
) -> float:
    """Return the stiction d of a motor after it has turned, see `Imperfections` [N m].

    d has a spring's energy d²/(2 σ K_g). Turning takes d²/most from it per angle, so it never gives more than it got,
    however load and speed change `most`.
    """
    slow = speed / stiction_speed
    most = (stiction + stiction_load * abs(load)) * math.exp(-slow * slow) + LEAST
    return relaxed(d, way, stiffness, most)
