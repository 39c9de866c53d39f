"""The one interface of all that judges the signals of a tick, and what it finds."""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

from tvist_controller.line.sample import Sample
from tvist_protocol.replies import Code


class Finding(NamedTuple):
    """What a monitor has found, and what it leads to."""

    why: str
    """The reason, for people."""
    code: Code | None = None
    """The reason, for programs."""
    then: Literal["warning", "interruption", "protective_stop"] = "warning"
    """A warning, the end of the present motion or stream, or a protective stop."""


class Monitor(ABC):
    """Judges the signals of a tick after the tick; `SafetyControl` has the list of all monitors of a robot."""

    needs: ClassVar[Literal["nothing", "drives", "drives alone"]] = "nothing"
    """When it looks: in every tick, while the drives hold the arm, or while no motion gives way to forces either."""

    awake = True
    """Whether it looks in ticks in which the arm measures no force."""

    @abstractmethod
    def look(self, sample: Sample) -> Finding | None:
        """Return what the latest tick has shown; None if all is well."""

    def restart(self) -> None:  # noqa: B027  most have no memory
        """Forget what was before: the arm was placed elsewhere, or the drives have begun to hold it."""
