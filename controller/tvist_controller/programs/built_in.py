"""Programs that can be loaded without any files, built from the robot's named poses."""

from dataclasses import dataclass
from typing import Final

from tvist_plant.description import RobotDescription

WAIT: Final = "wait_program.urp"
"""Plays until it is stopped, so that clients can try out play, pause and stop."""
PAPER: Final = "paper.urp"
"""Visits the poses in order, and returns the same way."""


@dataclass(frozen=True)
class ProgramLine:
    """One line of a program."""

    pose: str
    """Name of the pose."""
    q: tuple[float, ...]
    """Joint angles [rad]."""


def built_in(description: RobotDescription) -> dict[str, tuple[ProgramLine, ...]]:
    """Return the programs by file name; one without moves waits until it is stopped."""
    moves = [ProgramLine(name, tuple(q)) for name, q in description.poses.items()]
    programs: dict[str, tuple[ProgramLine, ...]] = {WAIT: ()}
    if moves:
        programs[PAPER] = (*moves, *moves[-2::-1])
    return programs | {f"{move.pose}.urp": (move,) for move in moves}
