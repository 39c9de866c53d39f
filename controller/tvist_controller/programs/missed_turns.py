"""Turns that a program's thread misses while it guides the arm, since the budget of a tick is spent before."""

from tvist_controller.commands.events import Emit
from tvist_controller.programs.arm import ProgramArm
from tvist_urscript import EVALUATIONS

SILENT = 5
"""Missed turns in a row after which the arm no longer keeps the velocity that was commanded last."""


class MissedTurns:
    """Warns of a thread that guides the arm and misses turns, and slows the arm down if it misses several in a row.

    Args:
        arm: The arm of the programs.
        emit: Emits events.
    """

    def __init__(self, arm: ProgramArm, emit: Emit) -> None:
        self._arm, self._emit = arm, emit
        self._missed = 0
        self._warned = False

    def clear(self) -> None:
        """Warn anew, since another program begins."""
        self._missed, self._warned = 0, False

    def look(self, starved: set[object]) -> None:
        """Look at the turn of the thread that guides the arm; called after the turns of all threads.

        Args:
            starved: Programs of which no thread had a turn.
        """
        driver = self._arm.driver
        if driver is None or not (driver[0] in starved or driver[0].missed(driver[1])):
            self._missed = 0
            return
        self._missed += 1
        name, line = driver[0].place(driver[1])
        what = f"{name}, line {line}, guides the arm but had no turn within the {EVALUATIONS} evaluations of a tick"
        if not self._warned:
            self._warned = True
            self._emit("warning", why=f"{what}: its last command goes on; compute less between its commands")
        if self._missed == SILENT:
            self._emit(
                "warning", why=f"{what}, {SILENT} times in a row: the arm slows down until its next command"
            )
            self._arm.slow_down()
