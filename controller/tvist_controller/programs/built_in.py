"""Programs that can be loaded without any files, made from the robot's named poses."""

from collections.abc import Sequence
from typing import Final

from tvist_plant.description import RobotDescription

WAIT: Final = "wait_program.urp"
"""Plays until it is stopped, so that clients can try out play, pause and stop."""
PAPER: Final = "paper.urp"
"""Visits the poses in order, and returns the same way."""


def built_in(description: RobotDescription) -> dict[str, str]:
    """Return the texts of the programs by file name; one without moves waits until it is stopped."""
    names = list(description.poses)
    programs = {WAIT: "def wait_program():\n  while True:\n    sync()\n  end\nend\n"}
    if names:
        programs[PAPER] = _moves("paper", [*names, *names[-2::-1]], description)
    return programs | {f"{name}.urp": _moves(name, [name], description) for name in names}


def _moves(title: str, names: Sequence[str], description: RobotDescription) -> str:
    """A program that moves to poses."""
    moves = [
        f"  movej({[float(angle) for angle in description.poses[name]]}, a=2.0, v=1.5)" for name in names
    ]
    return "\n".join((f"def {title}():", *moves, "end", ""))
