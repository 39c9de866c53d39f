"""Summarize in sentences what recordings show about shaping, independent of their file names."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from statistics import median

from tvist_lab.metrics import Comparison, MotionPair, MotionResult
from tvist_lab.metrics.comparison import TICK_MS
from tvist_lab.phrases import counted, either, sample, spread

NOTICEABLE = 0.15  # vibration that exceeds the sensor's noise [m/s²]
CLEAR = 15.0  # smallest change that counts as a difference [%]; equal runs differ by noise
LISTED = 6  # largest number of pairs that are listed
LESS, EARLIER = ("less", "more"), ("earlier", "later")  # words for positive and negative changes


@dataclass(frozen=True)
class Shaping:
    """Whether the reference of a recording was shaped, if known."""

    shaped: bool | None  # None if the recording has no reference before shaping
    sentence: str


def shaping_of(results: Sequence[MotionResult], name: str) -> Shaping:
    """Judge whether the reference was shaped, by how much later the target ends than the reference."""
    delays = [result.delay_ms for result in results if result.delay_ms is not None]
    if not delays:
        return Shaping(None, f"Whether {name} was shaped does not show: it has no reference before shaping.")
    shaped = [delay for delay in delays if delay >= TICK_MS]
    if not shaped:
        return Shaping(False, f"{name} was not shaped: its target ends together with its reference.")
    late = spread(shaped, "ms")
    if len(shaped) < len(delays):
        return Shaping(
            True,
            f"{len(shaped)} of {counted(len(delays), 'motion')} of {name} were shaped: their targets end "
            f"{late} after their references.",
        )
    return Shaping(True, f"{name} was shaped: its target ends {late} after its reference.")


def verdict_on_one(results: Sequence[MotionResult], name: str) -> list[str]:
    """Return how much the tool vibrates after the stops of one recording, and whether it was shaped."""
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
        first += f"; it is still {spread(still, 'ms')} after the start of a motion"
    return [f"{first}.", shaping_of(results, name).sentence]


def verdict_on_pairs(pairs: Sequence[MotionPair], results: Sequence[MotionResult], name: str) -> list[str]:
    """Return what each shaper of one recording changed, the best first, in the words of `tvist demo`."""
    shaper = attrgetter("shaper")
    of_shaper = [list(group) for _, group in groupby(sorted(pairs, key=shaper), shaper)]
    of_shaper.sort(key=lambda group: -median(one.change.less_percent or 0.0 for one in group))
    said = [sentence for group in of_shaper for sentence in _on_shaper(group, results, name)]
    if alone := len(results) - len({place for one in pairs for place in (one.unshaped, one.shaped)}):
        said.append(f"Made only with or only without a shaper: {counted(alone, 'motion')} of {name}.")
    return said


def _on_shaper(pairs: Sequence[MotionPair], results: Sequence[MotionResult], name: str) -> Iterator[str]:
    changes = [one.change for one in pairs]
    shaper = pairs[0].shaper or "the shaper"
    less = [change.less_percent for change in changes if change.less_percent is not None]
    if not less:
        yield f"{name}: what {shaper} changed about the vibration after the stop could not be measured."
        return
    lead = f"{name}: {either(less, '%', LESS)} vibration after the stop with {shaper} than without a shaper"
    peaks = [peak for change in changes for peak in (change.before, change.after) if peak is not None]
    if max(peaks) < NOTICEABLE:
        lead += ", though neither is noticeable"
    gained = [change.gain_ms for change in changes if change.gain_ms is not None]
    if gained:
        lead += f", at rest {either(gained, 'ms', EARLIER)}"
    longer = [delay for one in pairs if (delay := results[one.shaped].delay_ms) is not None]
    if longer:
        lead += f", for {'a motion that is' if len(pairs) == 1 else 'motions that are'} {spread(longer, 'ms')} longer"
    yield f"{lead} ({sample(len(pairs), 'motion')})."
    if 1 < len(pairs) <= LISTED:
        yield f"{'; '.join(f'{one.name}: {one.change.in_short()}' for one in pairs)}."


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
    changes = [one.change for one in comparison.motions]
    peaks = [
        (one.before, one.after, percent)
        for one in changes
        if one.before is not None and one.after is not None and (percent := one.less_percent) is not None
    ]
    many = counted(len(peaks), "motion")
    if not peaks:
        return [f"The vibration of {a} and {b} could not be measured, so nothing is compared.", *said]
    before, after, less = zip(*peaks, strict=True)
    numbers = f"{sample(len(peaks), 'motion')}: {spread(before, 'm/s²', 2)} and {spread(after, 'm/s²', 2)}"
    if max(median(before), median(after)) < NOTICEABLE:
        lead = f"Neither {a} nor {b} vibrates noticeably after its stops ({numbers})."
    elif abs(median(less)) >= CLEAR:
        gained = [one.gain_ms for one in changes if one.gain_ms is not None]
        sooner = f" and is still {either(gained, 'ms', EARLIER)}" if gained else ""
        lead = f"{b} vibrates {either(less, '%', LESS)} after its stops than {a} ({numbers}){sooner}."
    else:
        lead = f"{b} vibrates as much as {a} after its stops ({numbers}): nothing in it reduces vibration."
    if median(less) >= CLEAR and evidence[1].shaped is False:
        said.append(f"So shaping is not the reason why {b} vibrates less.")
    against = sum(one < 0.0 for one in less)
    if 0 < against < len(peaks) and median(less) >= CLEAR:
        said.append(f"In {against} of {many} it vibrates more.")
    return [lead, *said]
