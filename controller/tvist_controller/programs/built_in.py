"""Programs that a person can load before there are any others: made of the robot's named poses."""

from dataclasses import dataclass
from typing import Final

from tvist_plant.description import RobotDescription

WAIT: Final = "wait_program.urp"
"""It plays until somebody stops it: what a client needs that tries out play, pause and stop."""
PAPER: Final = "paper.urp"
"""Through the poses in order, and back."""


@dataclass(frozen=True)
class ProgramLine:
    """One line of a program."""

    pose: str
    """Its name."""
    q: tuple[float, ...]
    """[rad]."""


def built_in(description: RobotDescription) -> dict[str, tuple[ProgramLine, ...]]:
    """Programs by the names of their files; one without moves waits until it is stopped."""
    moves = [ProgramLine(name, tuple(q)) for name, q in description.poses.items()]
    programs: dict[str, tuple[ProgramLine, ...]] = {WAIT: ()}
    if moves:
        programs[PAPER] = (*moves, *moves[-2::-1])
    return programs | {f"{move.pose}.urp": (move,) for move in moves}
