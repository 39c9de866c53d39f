"""Conditions that cause a protective stop: excessive torque of a drive for too long, and a failing shaper."""

from typing import NamedTuple

from tvist_controller.cycle import ControlCycle
from tvist_controller.overload import Overload
from tvist_controller.sample import Sample
from tvist_protocol.replies import Code


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
        self._overload = Overload(cycle.description.limits.torque)

    def dangers(self, sample: Sample) -> list[Danger]:
        """Return the dangers after a tick, usually none.

        Args:
            sample: Signals along the control line.
        """
        found: list[Danger] = []
        joint = self._overload.joint(sample.measured.moment)
        if joint is not None:
            name, limit = self._cycle.description.robot.joints[joint], self._overload.limits[joint]
            moment = sample.measured.moment[joint]
            why = f"torque of joint {name} is {moment:.0f} N m, beyond its limit of {limit:g} for more than 10 ms"
            found.append(Danger(why, "limit_torque"))
        fault = self._cycle.line.filter.fault
        if fault is not None:  # the filter continues with old weights, because its shaper's function fails
            found.append(Danger(fault, None))
        return found

    def forget(self) -> None:
        """Restart the supervision."""
        self._overload.forget()
