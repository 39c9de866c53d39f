"""What a motion on a line of the joints would do if no command came, which no stop may get ahead of."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import STILL
from tvist_lab.recordings import Floats

ROUNDING = 1e-9
"""Differences between positions below this are rounding errors [rad]."""


@dataclass
class Undisturbed:
    """Future references if no command comes."""

    references: Floats
    """References from that moment on, one per tick, shape (k, n) [rad]."""
    since: int
    """Tick of that moment."""

    def breach(self, tick, q, *, resting):
        """Return in which way a stop is off the line, ahead of the motion, or later at rest; None if it is not."""
        references = self.references
        way = references[-1] - references[0]
        length = float(np.linalg.norm(way))
        if length < ROUNDING:
            return None
        along = way / length
        reached, there = (q - references[0]) @ along, references[min(tick, len(references) - 1)]
        # Changes below 1e-7 rad per tick count as rest, so the filter's tail still creeps.
        creeps = 10.0 * STILL if tick >= len(references) else 0.0
        if reached > (there - references[0]) @ along + ROUNDING + creeps:
            return "a stop is ahead of what the motion would have done"
        if np.abs(q - references[0] - reached * along).max() > ROUNDING:
            return "a stop leaves the line"
        if tick > len(references) + 1 and not resting:
            return "a stop lasts longer than the motion would have"
        return None
