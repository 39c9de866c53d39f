"""A robot's run, recorded: its moments by time."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from tvist_protocol.geometry import Geometry
from tvist_protocol.stream import State, Truth
from tvist_protocol.values import Payload
from tvist_view.scene import Moment
from tvist_view.signals import History, Signals


class TrackError(ValueError):
    """A run cannot be shown."""


@dataclass(frozen=True)
class Shown:
    """What a robot looks like, and what it is called."""

    label: str
    geometry: Geometry
    payload: Payload


class Track:
    """One robot's run.

    Args:
        shown: What it looks like.
        states: Its states in the order of their ticks.
        truths: Its truths; a state without one is drawn stiff.

    Raises:
        TrackError: There is no state.
    """

    def __init__(self, shown: Shown, states: Sequence[State], truths: Sequence[Truth]) -> None:
        if not states:
            raise TrackError("there is no state in it, so there is nothing to show")
        self.shown = shown
        by_tick = {truth.tick: truth for truth in truths}
        self._moments = [Moment(state, by_tick.get(state.tick)) for state in states]
        self._times = [state.timestamp for state in states]
        self.has_truth = any(moment.truth is not None for moment in self._moments)
        history = History(shown.geometry.alpha, len(states))
        for moment in self._moments:
            if moment.truth is not None:
                history.add_truth(moment.truth)
            history.add(moment.state)
        self.signals: Signals = history.signals()

    @property
    def start(self) -> float:
        """Simulation time of the first moment [s]."""
        return self._times[0]

    @property
    def end(self) -> float:
        """Simulation time of the last moment [s]."""
        return self._times[-1]

    def at(self, time: float) -> Moment:
        """The moment at a simulation time [s], or the nearest there is."""
        place = min(bisect_left(self._times, time - 1e-9), len(self._moments) - 1)
        return self._moments[place]
