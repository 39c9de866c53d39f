"""Notices that the thread of a guided motion gets no turn, so that the arm goes on at a speed that nothing renews."""

from collections.abc import Callable

from tvist_controller.commands.events import Emit
from tvist_controller.programs.arm import BRAKING, ProgramArm
from tvist_urscript import EVALUATIONS, Machine

SILENT = 25
"""Ticks that the thread may miss more than it has, before the arm brakes."""


class DriverWatch:
    """Watches the thread that guides the arm of one robot.

    Args:
        arm: The arm.
        stop: Stops its joints with a deceleration.
        emit: Emits events.
    """

    def __init__(self, arm: ProgramArm, stop: Callable[[float], None], emit: Emit) -> None:
        self._arm, self._stop, self._emit = arm, stop, emit
        self._silent = 0
        self._warned: set[int] = set()
        """Numbers of the threads of which a warning has told."""

    def look(self, machine: Machine, program: str, *, missed: bool) -> None:
        """Look at the thread at the end of a tick: warn once if it has missed it, brake if that lasts.

        Args:
            machine: The program that moves the arm.
            program: Its name.
            missed: Whether none of its threads had a turn.
        """
        driver = self._arm.driver
        if driver is None or driver[0] is not machine:
            self._silent = 0
        elif not (missed or machine.late(driver[1])):
            self._silent = max(self._silent - 1, 0)
        else:
            self._silent += 1
            if driver[1] not in self._warned:
                self._warned.add(driver[1])
                why = f"{machine.place(driver[1])} misses ticks while it guides the arm, which keeps its speed: "
                why += f"the program needs more than the {EVALUATIONS} evaluations of a tick, so let it compute less"
                self._emit("warning", why=why, program=program)
            if self._silent >= SILENT:
                self._arm.brake(lambda: self._stop(BRAKING))

    def forget(self) -> None:
        """Forget the threads of a program, which has ended."""
        self._silent = 0
        self._warned.clear()
