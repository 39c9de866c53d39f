"""Set-points for an arm that follows them with a lag: what to send so that it is where it should be."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from tvist_controller.trajectory.guided import DAMPED, DELAY
from tvist_controller.trajectory.limits import Floats
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, PlantError

LOOKAHEAD = 0.03
"""`lookahead_time` of `servoj`: the shortest, since the lag is compensated and a longer one only adds to what is sent
before a motion ends [s]."""
GAIN = 2000.0
"""`gain` of `servoj`: the largest, for the same reason [1/s²]."""

CUT = 1e-3
"""Distance of a set-point from where it should be that counts [rad]."""


@dataclass(frozen=True)
class ServoLag:
    """How `servoj` follows the set-points p, each held for a period: q̈ = k (p - q - T q̇)."""

    time: float
    """T, by which a motion of constant velocity is late [s]."""
    gain: float
    """k [1/s²]."""

    @classmethod
    def simulated(cls, lookahead: float = LOOKAHEAD, gain: float = GAIN) -> Self:
        """Return the lag of our simulated robots' `servoj`; that of a real robot has to be identified."""
        time = lookahead + DELAY * PERIOD
        return cls(time, max(gain, DAMPED / time**2))


class Setpoints:
    """Turns what the drives would get into set-points, one for each control period.

    The arm is where the line wants it if p = q + T q̇ + q̈/k. All three are taken in the middle between two commands,
    where p is held: q as their mean, q̇ as their difference, and q̈ as that of their velocities. Nothing of it is
    measured, so that there is no noise to amplify; at rest p is q to the last bit. No set-point is beyond the joints'
    range, or further from the one before than permitted: what is cut off there is made up for once there is room.

    Args:
        q: Joint angles at rest to start from, shape (n,) [rad].
        lag: The lag to compensate; None if it is not known, to send the positions themselves.
        fastest: Largest change of a set-point [rad/s].
        reach: Largest position of each joint in either direction, shape (n,) [rad].
    """

    def __init__(self, q: Floats, lag: ServoLag | None, *, fastest: float, reach: Floats) -> None:
        self._lag, self._most, self._reach = lag, fastest * PERIOD, np.array(reach)
        self.limited = 0
        """Number of set-points that are clearly not where they should be."""
        self.begin(q)

    def begin(self, q: Floats) -> None:
        """Restart at rest, shape (n,) [rad]."""
        self._q = self._sent = np.array(q, dtype=float)
        self._qd = np.zeros_like(self._q)

    def next(self, command: DriveCommand) -> Floats:
        """Return the set-point for the next command, shape (n,) [rad]; one that is no number raises `PlantError`."""
        wanted, lag = command.q, self._lag
        if lag is not None:
            velocity = (command.q - self._q) / PERIOD
            acceleration = (command.qd - self._qd) / PERIOD
            wanted = 0.5 * (command.q + self._q) + lag.time * velocity + acceleration / lag.gain
        if not np.isfinite(wanted).all():
            raise PlantError("a set-point is no number: it is not sent")
        self._q, self._qd = command.q, command.qd
        within = np.clip(wanted, -self._reach, self._reach)
        sent = np.clip(within, self._sent - self._most, self._sent + self._most)
        self.limited += bool(np.abs(sent - wanted).max() > CUT)
        self._sent = sent
        return sent
