"""Detection of drives whose torque exceeds their limits."""

from collections.abc import Sequence

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.control.differentiator import Floats
from tvist_plant.plant import PERIOD

ALLOWED = 0.01
"""How long a drive may exceed its limit [s]."""
TICKS = round(ALLOWED / PERIOD)


@compiled_for_ticks
def exceeds(values: Floats, limits: Floats) -> bool:
    """Return whether a magnitude exceeds its limit, each argument of shape (n,)."""
    for j in range(limits.shape[0]):  # noqa: SIM110  numba has no generators
        if abs(values[j]) > limits[j]:
            return True
    return False


class Overload:
    """Finds a joint whose drive has exceeded its torque limit for longer than `ALLOWED`.

    Args:
        limits: Largest torque of each joint, shape (n,) [N m].
    """

    def __init__(self, limits: Sequence[float]) -> None:
        self.limits = np.array(limits, dtype=float)
        self._beyond = np.zeros(len(limits), dtype=int)
        self._any = False
        exceeds(self.limits, self.limits)  # loads compiled code, which takes many ticks

    def joint(self, moment: Floats) -> int | None:
        """Take one more tick and return the joint with the longest excess, if it is too long; else None.

        Args:
            moment: Total torque of each drive, shape (n,) [N m].
        """
        if not exceeds(moment, self.limits):
            if self._any:
                self.forget()
            return None
        beyond, self._any = np.abs(moment) > self.limits, True
        self._beyond = np.where(beyond, self._beyond + 1, 0)
        joint = int(np.argmax(self._beyond))
        return joint if self._beyond[joint] > TICKS else None

    def forget(self) -> None:
        """Restart the count."""
        self._beyond[:] = 0
        self._any = False
