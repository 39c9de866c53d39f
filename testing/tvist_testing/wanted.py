"""The robot that a test wants, as its markers and the command line describe it."""

from dataclasses import dataclass
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
    """One robot, as it travels in JSON from the test's process to the process that makes robots."""

    options: dict[str, Any]
    """Options of `tvist serve`, as in a configuration file."""
    program: tuple[str, str] | None = None
    """Name and text of the program to load."""
    faults: tuple[WantedFault, ...] = ()
    ur: bool = False
    """Whether UR's interfaces are open, on an address of their own if the system has several."""
    log: str = ""
    """File that the robot writes its log to."""
