"""Detection of contacts from the force at the tool."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from tvist_controller.line.differentiator import Floats

REMEMBERED = 500
"""Ticks that are remembered, and after which a watch that nobody asks about ends."""
FIRST = 20
"""Ticks at the beginning of a watch whose mean is what the tool feels without a contact."""
ONSET = 0.2
"""Share of the threshold that counts as the beginning of a contact [-]."""


class ContactWatch:
    """Remembers the force at the tool from when it is first asked, and finds out since when something touches it."""

    def __init__(self) -> None:
        self._forces = deque[Floats](maxlen=REMEMBERED)
        self._usual: Floats | None = None
        self._asked = 0

    @property
    def awake(self) -> bool:
        """Whether somebody wants to know of contacts, so that `note` is to be called in every tick."""
        return self._asked > 0

    def note(self, force: Floats) -> None:
        """Take the force at the tool of a tick, base frame, shape (3,) [N]."""
        self._asked -= 1
        if self._asked == 0:
            self._forces.clear()
            self._usual = None
            return
        self._forces.append(force)
        if self._usual is None and len(self._forces) == FIRST:
            self._usual = np.mean(self._forces, axis=0)

    def steps(self, direction: Sequence[float], threshold: float, sure: int) -> int:
        """Return the number of ticks since just before a contact began; 0 if there is none.

        Args:
            direction: Direction in which the tool meets what it touches, base frame; zeros for any.
            threshold: Force from which on something touches the tool [N].
            sure: Ticks whose mean must exceed it.
        """
        self._asked = REMEMBERED
        if self._usual is None:
            return 0
        forces, length = np.array(self._forces) - self._usual, float(np.linalg.norm(direction))
        pushes = np.linalg.norm(forces, axis=1) if length == 0.0 else forces @ direction / -length
        if pushes[-sure:].mean() < threshold:
            return 0
        free = np.flatnonzero(pushes < ONSET * threshold)
        return len(pushes) - int(free[-1]) if len(free) else len(pushes)
