"""Conditions that cause a protective stop: excessive torque of a drive for too long, and a failing shaper."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.sample import Sample
from tvist_plant.plant import PERIOD
from tvist_protocol.replies import Code

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


class Danger(NamedTuple):
    """Reason for the arm to stop."""

    why: str
    """The reason, for people."""
    code: Code | None
    """The reason, for programs."""


class Protection:
    """Watches the control line while the drives hold the arm.

    Args:
        cycle: The control line.
    """

    def __init__(self, cycle: ControlCycle) -> None:
        self._cycle = cycle
        self._own = cycle.line.plant.supervised
        """Whether the arm's own controller watches its torques, which may be guessed here from currents."""
        self._overload = Overload(cycle.description.limits.torque)

    def dangers(self, sample: Sample) -> Sequence[Danger]:
        """Return the dangers after a tick, usually none.

        Args:
            sample: Signals along the control line.
        """
        joint = None if self._own else self._overload.joint(sample.measured.moment)
        fault = self._cycle.line.filter.fault
        if joint is None and fault is None:
            return ()
        found: list[Danger] = []
        if joint is not None:
            name, limit = self._cycle.description.robot.joints[joint], self._overload.limits[joint]
            moment = sample.measured.moment[joint]
            why = f"torque of joint {name} is {moment:.0f} N m, beyond its limit of {limit:g} for more than 10 ms"
            found.append(Danger(why, "limit_torque"))
        if fault is not None:  # the filter continues with old weights, because its shaper's function fails
            found.append(Danger(fault, None))
        return found

    def forget(self) -> None:
        """Restart the supervision."""
        self._overload.forget()
