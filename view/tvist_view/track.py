"""A recorded run of a robot."""

import base64
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tvist_protocol.stream import State, Truth
from tvist_view.look import Look
from tvist_view.signals import Signals, signals_of

ROW_TICKS = 5  # ticks between two rows for the page, which interpolates
MOVES = 1e-7  # change of a reference within a tick above which it counts as moving [rad]
SET = 0.05
"""Change of a reference within a tick above which it counts as a jump, for example by a reset [rad]."""
CALM = 50  # ticks of rest after which a motion has ended


class TrackError(ValueError):
    """A run cannot be shown."""


class Track:
    """One robot's run; a state without a truth is drawn stiff.

    `label` names it, `look` is its shape; `states` are in the order of their ticks; times count from the
    simulation time `origin` [s].
    """

    def __init__(
        self, label: str, look: Look, states: Sequence[State], truths: Sequence[Truth], origin: float = 0.0
    ) -> None:
        if not states:
            raise TrackError("the recording contains no state, so there is nothing to show")
        self.label, self.look, self._states, self._origin = label, look, states, origin
        self._truths = {truth.tick: truth for truth in truths}
        found = signals_of(look, states, self._truths)
        self.signals: Signals = replace(found, time=found.time - origin)

    @property
    def start(self) -> float:
        """Time of the first state [s]."""
        return self._states[0].timestamp - self._origin

    @property
    def end(self) -> float:
        """Time of the last state [s]."""
        return self._states[-1].timestamp - self._origin

    @property
    def stops(self) -> list[float]:
        """Times at which the unshaped reference came to rest for a while [s]."""
        q = np.array([state.reference_q for state in self._states])
        change = np.abs(np.diff(q, axis=0, prepend=q[:1])).max(axis=1)
        moves = (change > MOVES) & (change < SET)
        ends = np.flatnonzero(moves[:-1] & ~moves[1:])
        return [float(self.signals.time[end]) for end in ends if not moves[end + 1 : end + CALM].any()]

    def packed(self, start: float) -> dict[str, Any]:
        """Return the message for the page: rows and signals as base64 of 32-bit floats, times from `start` [s]."""
        states = self._states[::ROW_TICKS]
        rows = [self.look.row(state, self._truths.get(state.tick)) for state in states]
        signals = vars(self.signals) | {"time": self.signals.time - start}
        return {
            "label": self.label,
            "look": self.look.packed(),
            "reach": self.look.reach,
            "truth": bool(self._truths),
            "width": len(rows[0]),
            "times": _packed(np.array([state.timestamp for state in states]) - self._origin - start),
            "rows": _packed(np.array(rows)),
            "samples": {name: _packed(values) for name, values in signals.items()},
        }


def _packed(values: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()
