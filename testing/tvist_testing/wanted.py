"""The robot that a test wants, according to its markers and the command line."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class WantedFault:
    """A fault to inject, with the fields of `simulation.inject`."""

    fault: str
    joint: int | None = None
    seconds: float | None = None
    value: float | None = None
    after: float = 0.0  # simulation time of the injection [s]; 0 is before the first tick


@dataclass(frozen=True)
class WantedRobot:
    """One robot, in the form sent as JSON to the process that makes robots."""

    options: dict[str, Any]  # options of `tvist serve`, as in a configuration file
    program: tuple[str, str] | None = None  # name and text of the program to load
    faults: tuple[WantedFault, ...] = ()
    ur: bool = False  # whether UR's interfaces are open, on their own address if the system has several
    log: str = ""  # path of the robot's log
