"""Interface of all monitors of a tick's signals."""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

from tvist_controller.line.line_tick import Sample
from tvist_protocol.replies import Code


class MonitorFinding(NamedTuple):
    """A monitor's finding and its consequence."""

    why: str  # reason for users
    code: Code | None = None  # reason for programs
    then: Literal["warning", "interruption", "protective_stop"] = "warning"
    """Warn, end the present motion or stream, or make a protective stop."""


class Monitor(ABC):
    """Checks the signals of each tick afterwards; `SafetyControl` has a robot's list of monitors."""

    needs: ClassVar[Literal["nothing", "drives", "drives alone"]] = "nothing"
    """Run every tick, only while the drives hold the arm, or only if also no motion is compliant."""

    awake = True  # false to skip ticks without a measured force

    @abstractmethod
    def look(self, sample: Sample) -> MonitorFinding | None:
        """Return a finding about the latest tick, else None."""

    def restart(self) -> None:  # noqa: B027  most have no memory
        """Forget earlier ticks: the arm was placed elsewhere, or the drives have started to hold it."""
