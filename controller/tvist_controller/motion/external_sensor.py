"""A force sensor of the user's own at the flange, whose values clients send."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_plant.plant import PERIOD

SILENT = 0.1
"""Time without a value after which it counts as silent [s]."""


class ExternalSensor:
    """Takes the place of the arm's own sensor while it is used and not silent.

    Args:
        timeouts: Whether it may fall silent; in lockstep nothing times out.
    """

    def __init__(self, *, timeouts: bool) -> None:
        self._most = round(SILENT / PERIOD) if timeouts else np.inf
        self._offset: Sequence[float] | None = None
        self._wrench: Floats | None = None
        self._age = 0

    def use(self, offset: Sequence[float] | None) -> None:
        """Use it from now on; None: no more, and what it told does not count any longer.

        Args:
            offset: Where it measures, in the flange frame, shape (3,) [m].
        """
        self._offset, self._wrench = offset, None if offset is None else self._wrench

    def sense(self, wrench: Floats) -> None:
        """Take what it measures, in the directions of the flange frame, shape (6,) [N, N m]."""
        self._wrench, self._age = wrench, 0

    @property
    def awaited(self) -> bool:
        """Whether the sensor is in use, and its last value is too old or has not come yet."""
        return self._offset is not None and self._wrench is None

    def next(self) -> Floats | None:
        """Return what it feels in the next tick about the flange's origin, shape (6,); None if it is not used."""
        self._age += 1
        if self._age > self._most:
            self._wrench = None
        if self._offset is None or self._wrench is None:
            return None
        force, torque = self._wrench[:3], self._wrench[3:]
        return np.concatenate((force, torque + np.cross(self._offset, force)))
