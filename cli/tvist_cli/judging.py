"""How much less a motion shakes with a shaper, by the same measure as `tvist log compare`."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_lab.recordings import Recording
    from tvist_view.beside import Run, Verdict


def judge(without: "Run", shaped: "Run") -> "Verdict":
    """Measure one motion without and with a shaper, each with the rest after it; what it lacks is None."""
    from tvist_lab.metrics.comparison import compare
    from tvist_lab.metrics.table import Measured
    from tvist_view.beside import Verdict

    first, second = (Measured.of(_recording(run)) for run in (without, shaped))
    motions = compare(first, second).motions
    if not motions:
        return Verdict(None, None, None, None)
    one = motions[0]
    before, after = one.first.peak_m_s2, one.second.peak_m_s2
    still = one.first.still_after_ms, one.second.still_after_ms
    change = one.impact_percent["peak"]
    return Verdict(
        less_percent=None if change is None else -change,
        earlier_ms=None if still[0] is None or still[1] is None else still[0] - still[1],
        before=before,
        after=after,
    )


def _recording(run: "Run") -> "Recording":
    """One motion as columns: where a truth was lost on the way, by the sensor."""
    from tvist_lab.recordings.recorded_columns import recording_of_messages

    states, truths = run.states, run.truths
    if truths:  # at both ends a state may have come without its truth
        states = [state for state in states if truths[0].tick <= state.tick <= truths[-1].tick]
    known = {truth.tick for truth in truths}
    if not all(state.tick in known for state in states):
        states, truths = run.states, []
    return recording_of_messages(states, run.events, truths)
