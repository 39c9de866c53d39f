"""Detects a robot's overload, as the protocol's `telemetry` defines it, by counting ticks without a clock."""

BEGINS, BEGINS_AFTER = 0.20, 2
"""Share of a second's due ticks that must be missed [-], and number of such seconds in a row, to enter overload."""
ENDS, ENDS_AFTER = 0.05, 5
"""Share below which missed ticks must fall [-], and number of such seconds in a row, to leave overload."""


class TickCounts:
    """Counts a robot's due and missed ticks, `period` apart [s]; a second is as many due ticks as fit in it.

    A pause of the whole machine is one long second with almost all ticks missed, which alone is no overload.
    """

    def __init__(self, period: float) -> None:
        self.due_per_second = 1.0 / period
        self.due = self.missed = 0
        self.overloaded = False
        self._due = self._missed = 0  # `due` and `missed` at the start of the present second
        self._since = 0, 0  # `due` and `missed` at the start of the present overload
        self._seconds = 0

    def note(self, missed: int) -> str | None:
        """Count a tick and the `missed` ones that its schedule reports; return a message if overload starts or ends."""
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
