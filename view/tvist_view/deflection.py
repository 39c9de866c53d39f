"""Deflections made visible: the truth of a simulated arm, magnified."""

from dataclasses import dataclass

import numpy as np

from tvist_protocol.stream import Truth
from tvist_view.chain import Floats

MAX_FACTOR = 300.0


@dataclass(frozen=True)
class Magnification:
    """How much larger than in truth gears and links are drawn to deflect."""

    factor: float = 1.0
    """1 to 300; at 1 the arm is drawn where it is [-]."""
    gravity: bool = False
    """Magnify the static part, too: the arm hangs. Otherwise only what differs from it, which is the vibration."""

    def drawn(self, truth: Truth) -> tuple[Floats, Floats]:
        """Angles of joints and of bending links to draw.

        A deflection x with the static part s is drawn as s + k (x - s), or as k x with gravity.

        Args:
            truth: Truth of one tick.

        Returns:
            Joint angles on the link side, shape (n,), and link deflections, two per bending link [rad].
        """
        gears = self._magnified(truth.gear_deflection, truth.static_gear_deflection)
        links = self._magnified(truth.link_deflection, truth.static_link_deflection)
        return np.array(truth.motor_q) + gears, links

    def _magnified(self, deflection: list[float], static: list[float]) -> Floats:
        x = np.array(deflection)
        rest = np.zeros_like(x) if self.gravity or len(static) != len(x) else np.array(static)
        return np.asarray(rest + self.factor * (x - rest))


def knows_static(truth: Truth) -> bool:
    """Tell if the static part is known; older servers and recordings do not tell it."""
    return len(truth.static_gear_deflection) == len(truth.gear_deflection)
