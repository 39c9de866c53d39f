"""The robot that a test wants, as its markers and the command line describe it."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class WantedFault:
    """A fault to inject, with the fields of `simulation.inject`."""

    fault: str
    joint: int | None = None
    seconds: float | None = None
    value: float | None = None
    after: float = 0.0
    """Simulation time at which it is injected [s]; 0: before the first tick."""


@dataclass(frozen=True)
class WantedRobot:
    """One robot, as it travels from the test's process to the process that makes robots."""

    options: dict[str, Any]
    """Options of `tvist serve`, as in a configuration file."""
    program: tuple[str, str] | None = None
    """Name and text of the program to load."""
    faults: tuple[WantedFault, ...] = ()
    ur: bool = False
    """Whether UR's interfaces are open, on an address of their own if the system has several."""
    log: str = ""
    """File that the robot writes its log to."""

    def to_builtins(self) -> dict[str, Any]:
        """Return what `from_builtins` takes, of the types that JSON knows."""
        return asdict(self)

    @classmethod
    def from_builtins(cls, content: dict[str, Any]) -> "WantedRobot":
        """Return the robot that `to_builtins` described."""
        faults = tuple(WantedFault(**one) for one in content["faults"])
        program = None if content["program"] is None else tuple(content["program"])
        return cls(**{**content, "faults": faults, "program": program})
