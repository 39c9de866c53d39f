"""Monitors of a tick's signals: the interface, overloaded drives, and failing shapers."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.line_tick import Sample
from tvist_plant.plant import PERIOD
from tvist_protocol.replies import Code

ALLOWED = 0.01  # permitted duration of an overload [s]
TICKS = round(ALLOWED / PERIOD)


class MonitorFinding(NamedTuple):
    """A monitor's finding and its consequence."""

    why: str  # reason for users
    code: Code | None = None  # reason for programs
    then: Literal["warning", "interruption", "protective_stop"] = "warning"
    """Warn, end the present motion or stream, or make a protective stop."""


class Monitor(ABC):
    """Checks the signals of each tick afterwards; `SafetyControl` has a robot's list of monitors."""

    needs: ClassVar[Literal["nothing", "drives", "drives alone"]] = "nothing"
    """When to run: every tick, only while the drives hold the arm, or only if also no motion is compliant."""

    awake = True  # false if the monitor may be skipped in ticks without a measured force

    @abstractmethod
    def look(self, sample: Sample) -> MonitorFinding | None:
        """Return a finding about the latest tick, else None."""

    def restart(self) -> None:  # noqa: B027  most have no memory
        """Forget earlier ticks: the arm was placed elsewhere, or the drives have started to hold it."""


class TorqueOverload(Monitor):
    """Detects a joint whose drive exceeds its torque limit [N m] for longer than `ALLOWED`."""

    needs: ClassVar = "drives"

    def __init__(self, joints: Sequence[str], limits: Sequence[float]) -> None:
        self._joints, self._limits = joints, np.array(limits, dtype=float)
        self._beyond = np.zeros(len(limits), dtype=int)

    def look(self, sample: Sample) -> MonitorFinding | None:
        """Return the longest overload if it has lasted too long, and restart the count."""
        moment = sample.measured.moment
        self._beyond = np.where(np.abs(moment) > self._limits, self._beyond + 1, 0)
        joint = int(np.argmax(self._beyond))
        if self._beyond[joint] <= TICKS:
            return None
        self.restart()
        why = (
            f"torque of joint {self._joints[joint]} is {moment[joint]:.0f} N m, beyond its limit of "
            f"{self._limits[joint]:g} for more than 10 ms"
        )
        return MonitorFinding(why, "limit_torque", "protective_stop")

    def restart(self) -> None:
        """Restart the count."""
        self._beyond[:] = 0


class ShaperMonitor(Monitor):
    """Detects a failing shaper; warns once if it misses its specification or its feed-forward is limited."""

    def __init__(self, cycle: ControlCycle) -> None:
        self._cycle = cycle
        self._clipped = self._limited = False

    def look(self, sample: Sample) -> MonitorFinding | None:
        """Return a fault of the filter, or a warning about the shaper or its feed-forward, else None."""
        line_filter, mode = self._cycle.filter, self._cycle.mode
        if (fault := line_filter.fault) is not None:  # the filter continues with old weights
            return MonitorFinding(fault, None, "protective_stop")
        began, self._clipped = line_filter.tvist.clipped and not self._clipped, line_filter.tvist.clipped
        if began:
            why = (
                f"{line_filter.tvist.name} cannot meet its specification here: it needs a longer delay line, or "
                "leaves more vibration. Choose another shaper for these poses, or a pose in which the arm is stiffer"
            )
            return MonitorFinding(why, "out_of_range")
        limited = sample.motors is not None and sample.motors.limited
        told, self._limited = self._limited, self._limited and not mode.at_rest
        if not limited or told or mode in {LineMode.STOPPING, LineMode.REST}:
            return None
        self._limited = True
        why = (
            "the torque limits keep the motors from leading enough: the arm will vibrate more after this motion. "
            "Move with less acceleration, or choose a shaper without feed-forward, such as auto"
        )
        return MonitorFinding(why, "limit_torque")
