"""What a shaper changed about the vibration after a stop: one computation, in the same words, for every command."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AfterStop:
    """How the tool vibrates after one motion."""

    peak: float | None
    """Largest |α| [m/s²]; None if it was not measurable."""
    still_ms: float | None
    """Time from the start of the motion until the tool is at rest [ms]; None if it never was."""


@dataclass(frozen=True)
class Change:
    """The same motion without and with a shaper."""

    before: AfterStop
    after: AfterStop

    @property
    def less_percent(self) -> float | None:
        """By how much the tool vibrates less [%], negative where it is more; None where it is not defined."""
        before, after = self.before.peak, self.after.peak
        return None if before is None or after is None or before == 0.0 else 100.0 * (1.0 - after / before)

    @property
    def gain_ms(self) -> int | None:
        """By how much earlier the tool is at rest [ms], negative where it is later; None where it never is."""
        before, after = self.before.still_ms, self.after.still_ms
        return None if before is None or after is None else round(before - after)

    def less(self) -> str:
        """How much less or more it vibrates."""
        percent = self.less_percent
        if percent is None:
            return "not to be compared"
        return f"{abs(percent):.0f} % {'less' if percent >= 0.0 else 'more'}"

    def rest(self) -> str:
        """What the shaped tool did, with regard to rest."""
        if self.gain_ms is not None:
            return f"came to rest {abs(self.gain_ms)} ms {'earlier' if self.gain_ms >= 0 else 'later'}"
        if self.after.still_ms is not None:
            return "came to rest, which the unshaped one did not"
        return "was not at rest when the recording ended"

    def in_short(self) -> str:
        """Both in a line."""
        return f"{self.less()}, {self.rest()}"
