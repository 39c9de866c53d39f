"""Moments of a running robot: a state and its truth are two messages, which come in any order."""

from tvist_protocol.stream import State, Truth
from tvist_view.scene import Moment

KEPT = 64
"""Number of ticks within which a state and its truth find each other."""


class Moments:
    """The newest messages of one robot, matched by their ticks."""

    def __init__(self) -> None:
        self._states: dict[int, State] = {}
        self._truths: dict[int, Truth] = {}

    def add(self, message: State | Truth) -> None:
        """Keep a message; an earlier tick than the last one's is that of a robot that has started anew."""
        kept: dict[int, State] | dict[int, Truth] = (
            self._states if isinstance(message, State) else self._truths
        )
        if kept and message.tick < max(kept):
            self._states.clear()
            self._truths.clear()
        if isinstance(message, State):
            self._states[message.tick] = message
        else:
            self._truths[message.tick] = message
        if len(kept) > KEPT:
            del kept[min(kept)]

    def newest(self) -> Moment | None:
        """The newest tick of which both are known; without any the newest state, and before the first one None."""
        if both := self._states.keys() & self._truths.keys():
            return Moment(self._states[max(both)], self._truths[max(both)])
        return Moment(self._states[max(self._states)], None) if self._states else None
