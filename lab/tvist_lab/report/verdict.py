"""What recordings show about shaping, in sentences; what a file is called does not count."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from tvist_lab.metrics import Comparison, MotionResult
from tvist_lab.words import counted

TICK_MS = 2.0
"""Shortest delay of a shaped reference [ms]: one tick."""
NOTICEABLE = 0.15
"""Vibration that stands out of the sensor's noise [m/s²]."""
CLEAR = 15.0
"""Smallest change that counts as a difference [%]; equal runs differ by noise."""


@dataclass(frozen=True)
class Shaping:
    """Whether the reference of a recording was shaped, as far as it shows."""

    shaped: bool | None
    """None if the recording has no reference before shaping."""
    sentence: str


def shaping_of(results: Sequence[MotionResult], name: str) -> Shaping:
    """Judge by the time by which the target ends later than its reference."""
    delays = [result.delay_ms for result in results if result.delay_ms is not None]
    if not delays:
        return Shaping(None, f"Whether {name} was shaped does not show: it has no reference before shaping.")
    shaped = [delay for delay in delays if delay >= TICK_MS]
    if not shaped:
        return Shaping(False, f"{name} was not shaped: its target ends together with its reference.")
    late = median(shaped)
    if len(shaped) < len(delays):
        return Shaping(
            True,
            f"{len(shaped)} of {counted(len(delays), 'motion')} of {name} were shaped: their targets end "
            f"{late:.0f} ms after their references (median).",
        )
    return Shaping(True, f"{name} was shaped: its target ends {late:.0f} ms after its reference.")


def verdict_on_one(results: Sequence[MotionResult], name: str) -> list[str]:
    """How much the tool vibrates after the stops of one recording, and whether it was shaped."""
    if not results:
        return [f"{name} contains no motion."]
    peaks = [result.peak_m_s2 for result in results if result.peak_m_s2 is not None]
    still = [result.still_after_ms for result in results if result.still_after_ms is not None]
    many = counted(len(results), "motion")
    if not peaks:
        return [
            f"{name} contains {many}, but no vibration could be measured.",
            shaping_of(results, name).sentence,
        ]
    loud = sum(peak > NOTICEABLE for peak in peaks)
    what = (
        f"the tool vibrates noticeably after {loud} of {counted(len(peaks), 'stop')}, by up to {max(peaks):.2f} m/s²"
        if loud
        else f"the tool does not vibrate noticeably after any of {counted(len(peaks), 'stop')} "
        f"(at most {max(peaks):.2f} m/s²)"
    )
    first = f"{name}: {what}"
    if still:
        first += f"; it is still {median(still):.0f} ms after the start of a motion (median)"
    return [f"{first}.", shaping_of(results, name).sentence]


def verdict_on_two(
    comparison: Comparison,
    first: Sequence[MotionResult],
    second: Sequence[MotionResult],
    names: tuple[str, str],
) -> list[str]:
    """Judge whether the second recording vibrates less than the first, and whether shaping can be the reason."""
    a, b = names
    evidence = [shaping_of(first, a), shaping_of(second, b)]
    said = [one.sentence for one in evidence]
    if not comparison.motions:
        return [f"{a} and {b} have no motion in common, so nothing is compared.", *said]
    peaks = [
        (one.first.peak_m_s2, one.second.peak_m_s2)
        for one in comparison.motions
        if one.first.peak_m_s2 is not None and one.second.peak_m_s2 is not None
    ]
    many = counted(len(peaks), "motion")
    if not peaks:
        return [f"The vibration of {a} and {b} could not be measured, so nothing is compared.", *said]
    before, after = median(peak for peak, _ in peaks), median(peak for _, peak in peaks)
    change = median(100.0 * (second_peak / first_peak - 1.0) for first_peak, second_peak in peaks)
    numbers = f"median of {many}: {before:.2f} and {after:.2f} m/s²"
    if max(before, after) < NOTICEABLE:
        lead = f"Neither {a} nor {b} vibrates noticeably after its stops ({numbers})."
    elif change <= -CLEAR:
        lead = f"{b} vibrates {-change:.0f} % less after its stops than {a} ({numbers}){_sooner(comparison)}."
    elif change >= CLEAR:
        lead = f"{b} vibrates {change:.0f} % more after its stops than {a} ({numbers}){_sooner(comparison)}."
    else:
        lead = f"{b} vibrates as much as {a} after its stops ({numbers}): nothing in it reduces vibration."
    if change <= -CLEAR and evidence[1].shaped is False:
        said.append(f"So shaping is not the reason why {b} vibrates less.")
    against = sum(second_peak > first_peak for first_peak, second_peak in peaks)
    if 0 < against < len(peaks) and change <= -CLEAR:
        said.append(f"In {against} of {many} it vibrates more.")
    return [lead, *said]


def _sooner(comparison: Comparison) -> str:
    """By how much earlier or later the second recording is still."""
    gained = [
        one.first.still_after_ms - one.second.still_after_ms
        for one in comparison.motions
        if one.first.still_after_ms is not None and one.second.still_after_ms is not None
    ]
    if not gained:
        return ""
    by = median(gained)
    return f" and is still {abs(by):.0f} ms {'earlier' if by >= 0.0 else 'later'}"
