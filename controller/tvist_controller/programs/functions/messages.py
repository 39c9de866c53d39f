"""Functions for messages to people, and for time."""

from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import flag, integer, number, readable
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import Turns
from tvist_controller.programs.popups import Popups
from tvist_plant.plant import PERIOD
from tvist_protocol.stream import PopupKind
from tvist_urscript import Array, Fault, Struct, Value, costs, to_str

LONGEST_TEXT = 350
"""Elements of a list that fit into a text."""
LONGEST_SLEEP = 1e6
"""Longest time of `sleep` [s]."""


class MessageFunctions:
    """Tells people something, and waits.

    Args:
        access: The robot.
        arm: Its arm.
        popups: Its popups.
    """

    def __init__(self, access: Access, arm: ProgramArm, popups: Popups) -> None:
        self._access, self._arm, self._popups = access, arm, popups

    @costs(30)
    def textmsg(self, s1: Value, s2: Value = "") -> None:
        """Write a line to the log, which clients of the primary interface get."""
        text = readable(f"{self._written(s1)}{self._written(s2)}")
        self._arm.then(lambda: self._access.emit("text", why=text))

    @costs(20)
    def popup(
        self,
        s: Value,
        title: Value = "Popup",
        warning: object = False,
        error: object = False,
        blocking: object = False,
    ) -> Turns:
        """Show a message; with `blocking`, wait until somebody closes it."""
        text, head = readable(self._written(s)), readable(self._written(title))
        kind: PopupKind = (
            "error" if flag("error", error) else "warning" if flag("warning", warning) else "message"
        )
        waits = flag("blocking", blocking)
        yield from self._arm.finish()
        self._popups.show(text, head, kind, blocking=waits)
        if waits:
            while self._popups.shown:
                yield

    def _written(self, value: Value) -> str:
        if isinstance(value, Array):
            self._arm.spend(3 * min(value.size, LONGEST_TEXT))
        return to_str(value)

    def time(self, mode: object = 0) -> Struct:
        """Return the time since the robot's start as `struct(sec, nanosec)`; there is no clock of the day (`mode` 2).

        Raises:
            Fault: Another time is asked for.
        """
        if (which := integer("mode", mode, 0, 2)) != 0:
            raise Fault(f"time: mode is {which}; this controller has no clock of the day, so it must be 0")
        sec, nanosec = divmod(round(self._access.latest().timestamp * 1e9), 10**9)
        return Struct(("sec", "nanosec"), (sec, nanosec))

    def sync(self) -> Turns:
        """Wait for the next tick."""
        yield from self._arm.finish()
        yield

    def sleep(self, t: object) -> Turns:
        """Wait for a time [s]; a time of at least half a tick waits for at least one."""
        ticks = round(number("t", t, 0.0, LONGEST_SLEEP) / PERIOD)
        yield from self._arm.finish()
        for _ in range(ticks):
            yield
