"""Dahl's friction, and stiction of a motor near standstill."""

import math

from tvist_kernels.compiling import compiled

MIN_TORQUE = 1e-9  # remaining stiction of a fast motor, to avoid a division by zero [N m]


@compiled
def relaxed(z: float, way: float, stiffness: float, most: float) -> float:
    """Return Dahl's friction (1968) after a travel (z before): exact for dz/dx = k (1 - z sgn(ẋ)/most)."""
    end = most if way > 0.0 else -most
    return float(end + (z - end) * math.exp(-stiffness * abs(way) / most))


@compiled
def stiction_after(
    d: float,  # stiction before [N m]
    way: float,  # angle by which the motor turns [rad]
    speed: float,  # speed at which the motor turns [rad/s]
    load: float,  # torque in its gear [N m]
    stiction: float,  # F_s [N m]
    stiction_load: float,  # μ_s [-]
    stiction_speed: float,  # v_s [rad/s]
    stiffness: float,  # σ K_g [N m/rad]
) -> float:
    """Return the stiction d of a motor after it has turned, see `Imperfections` [N m].

    Stiction dissipates d²/most per angle: it returns no more energy than it stored, however `most` changes.
    """
    slow = speed / stiction_speed
    most = (stiction + stiction_load * abs(load)) * math.exp(-slow * slow) + MIN_TORQUE
    return relaxed(d, way, stiffness, most)
