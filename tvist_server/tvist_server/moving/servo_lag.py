"""Compensates the lag with which `servoj` follows set-points."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.guided import DAMPED, DELAY
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, PlantError
from tvist_server.moving.program import GAIN, LOOKAHEAD

CUT = 1e-3  # smallest cut of a set-point that is counted [rad]


@dataclass(frozen=True)
class ServoLag:
    """How `servoj` follows the set-points p, each held for a period: q̈ = k (p - q - T q̇)."""

    time: float  # t, the delay of a motion of constant velocity [s]
    gain: float  # k [1/s²]

    @classmethod
    def simulated(cls, lookahead: float = LOOKAHEAD, gain: float = GAIN) -> Self:
        """Return the lag of `servoj` on a robot simulated by tvist; that of a real robot must be identified."""
        time = lookahead + DELAY * PERIOD
        return cls(time, max(gain, DAMPED / time**2))


class ServoSetpoints:
    """Turns drive commands into set-points, one for each control period, which compensate the lag of `servoj`.

    The arm is at the reference if p = q + T q̇ + q̈/k. All three are taken midway between two commands, where p is
    held: q as their mean, q̇ and q̈ as difference quotients of q and q̇. Nothing is measured, so no noise is
    amplified, and at rest p equals q to the last bit. A set-point is cut to the joints' range `reach` [rad] and to
    the largest speed `fastest` [rad/s]; later ones make up for the cut. Without a lag, p is q.
    """

    def __init__(self, q: Floats, lag: ServoLag | None, *, fastest: float, reach: Floats) -> None:
        self._lag, self._most, self._reach = lag, fastest * PERIOD, np.array(reach)
        self.limited = 0  # number of set-points that were cut by more than `CUT`
        self.begin(q)

    def begin(self, q: Floats) -> None:
        """Restart at rest, shape (n,) [rad]."""
        self._q = self._sent = np.array(q, dtype=float)
        self._qd = np.zeros_like(self._q)

    def next(self, command: DriveCommand) -> Floats:
        """Return the set-point for the next command, shape (n,) [rad]; raise PlantError if it is not finite."""
        wanted, lag = command.q, self._lag
        if lag is not None:
            velocity = (command.q - self._q) / PERIOD
            acceleration = (command.qd - self._qd) / PERIOD
            wanted = 0.5 * (command.q + self._q) + lag.time * velocity + acceleration / lag.gain
        if not np.isfinite(wanted).all():
            raise PlantError("a set-point is not a finite number: it is not sent")
        self._q, self._qd = command.q, command.qd
        within = np.clip(wanted, -self._reach, self._reach)
        sent = np.clip(within, self._sent - self._most, self._sent + self._most)
        self.limited += bool(np.abs(sent - wanted).max() > CUT)
        self._sent = sent
        return sent
