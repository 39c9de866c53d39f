"""What makes a protective stop by itself: drives that give too much for too long, and a shaper that fails."""

from typing import NamedTuple

from tvist_controller.cycle import ControlCycle, Sample
from tvist_controller.overload import Overload
from tvist_protocol.replies import Code


class Danger(NamedTuple):
    """Why the arm has to stop."""

    why: str
    """For a person."""
    code: Code | None
    """For a program."""


class Protection:
    """Watches the control line while the drives hold the arm.

    Args:
        cycle: The control line.
    """

    def __init__(self, cycle: ControlCycle) -> None:
        self._cycle = cycle
        self._overload = Overload(cycle.description.limits.torque)

    def dangers(self, sample: Sample) -> list[Danger]:
        """What is wrong after a tick; mostly nothing.

        Args:
            sample: What went along the line.
        """
        found: list[Danger] = []
        joint = self._overload.joint(sample.measured.moment)
        if joint is not None:
            name, limit = self._cycle.description.robot.joints[joint], self._overload.limits[joint]
            moment = sample.measured.moment[joint]
            why = f"torque of joint {name} is {moment:.0f} N m, beyond its limit of {limit:g} for more than 10 ms"
            found.append(Danger(why, "limit_torque"))
        fault = self._cycle.line_filter.fault
        if fault is not None:  # the filter only goes on with old weights, because its shaper's function fails
            found.append(Danger(fault, None))
        return found

    def forget(self) -> None:
        """Begin to watch anew."""
        self._overload.forget()
