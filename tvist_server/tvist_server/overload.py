"""Whether a robot is overloaded, as `telemetry` of the protocol defines it. Here is no clock: ticks are counted."""

BEGINS, BEGINS_AFTER = 0.20, 2
"""Share of the ticks due in a second that must be missed [-], and number of such seconds in a row, for it to begin."""
ENDS, ENDS_AFTER = 0.05, 5
"""Share that fewer must be missed than [-], and number of such seconds in a row, for it to end."""


class Overload:
    """Counts a robot's ticks: those due, and those missed. A second is as many due ticks as it contains.

    A pause of the whole machine makes one long second, in which almost all were missed, so it alone is no overload.

    Args:
        period: Distance of two deadlines [s].
    """

    def __init__(self, period: float) -> None:
        self.due_per_second = 1.0 / period
        self.due = self.missed = 0
        """Ticks since the start."""
        self.overloaded = False
        self._due = self._missed = 0  # when the present second began
        self._since = 0, 0  # when the present overload began
        self._seconds = 0

    def note(self, missed: int) -> str | None:
        """Count a tick that begins.

        Args:
            missed: Number of ticks that its schedule reports as missed: this one, and those left out before it.

        Returns:
            A sentence if the overload begins or ends.
        """
        self.due += max(1, missed)
        self.missed += missed
        due, missed = self.due - self._due, self.missed - self._missed
        if due < self.due_per_second:
            return None
        before = self._due, self._missed
        self._due, self._missed = self.due, self.missed
        changes = missed < ENDS * due if self.overloaded else missed >= BEGINS * due
        self._seconds = self._seconds + 1 if changes else 0
        if self._seconds < (ENDS_AFTER if self.overloaded else BEGINS_AFTER):
            return None
        self.overloaded, self._seconds = not self.overloaded, 0
        if self.overloaded:
            self._since = before
            return (
                f"the control loop is overloaded: {missed} of the {due} control periods due in the last second were "
                "missed. Next: end other programs, serve fewer robots in this process, or start it with more --workers "
                "or with --realtime-priority"
            )
        due, missed = self.due - self._since[0], self.missed - self._since[1]
        return f"the control loop is no longer overloaded: meanwhile {missed} of {due} control periods were missed"
