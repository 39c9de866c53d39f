"""Reduction of the vibration after a stop by a shaper, in the same words for every command."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MotionChange:
    """Vibration of the same motion without and with a shaper; None if not measurable."""

    before: float | None  # largest |α| after the unshaped motion [m/s²]
    after: float | None  # largest |α| after the shaped one [m/s²]
    still_before: float | None  # time from the start of the unshaped motion until the tool is at rest [ms]
    still_after: float | None  # time from the start of the shaped motion until the tool is at rest [ms]

    @property
    def less_percent(self) -> float | None:
        """Reduction of the vibration [%], negative if it grew; None if not defined."""
        if self.before is None or self.after is None or self.before == 0.0:
            return None
        return 100.0 * (1.0 - self.after / self.before)

    @property
    def gain_ms(self) -> int | None:
        """How much earlier the tool is at rest [ms], negative if later; None if it never is."""
        if self.still_before is None or self.still_after is None:
            return None
        return round(self.still_before - self.still_after)

    def as_dict(self) -> dict[str, float | None]:
        """Return the numbers that the page of `tvist view` shows."""
        return {
            "less_percent": self.less_percent, "earlier_ms": self.gain_ms, "before": self.before, "after": self.after,
        }  # fmt: skip

    def less(self) -> str:
        """Return the reduction as text."""
        percent = self.less_percent
        if percent is None:
            return "not to be compared"
        return f"{abs(percent):.0f} % {'less' if percent >= 0.0 else 'more'}"

    def rest(self) -> str:
        """Return as text how the settling time changed."""
        if self.gain_ms is not None:
            return f"came to rest {abs(self.gain_ms)} ms {'earlier' if self.gain_ms >= 0 else 'later'}"
        if self.still_after is not None:
            return "came to rest, which the unshaped one did not"
        return "was not at rest when the recording ended"

    def in_short(self) -> str:
        """Return both changes as one line of text."""
        return f"{self.less()}, {self.rest()}"
