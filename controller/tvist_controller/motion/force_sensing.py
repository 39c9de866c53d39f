"""The user's own force sensor, and contacts found from the force at the tool."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_plant.plant import PERIOD

REMEMBERED = 500
"""Ticks that are remembered, and after which a watch that nobody asks about ends."""
FIRST = 20
"""Ticks at the beginning of a watch whose mean is what the tool feels without a contact."""
ONSET = 0.2
"""Share of the threshold that counts as the beginning of a contact [-]."""
SILENT = 0.1
"""Time without a value after which it counts as silent [s]."""


class ContactWatch:
    """Remembers the force at the tool from when it is first asked, and finds out since when something touches it."""

    def __init__(self) -> None:
        self._forces = deque[Floats](maxlen=REMEMBERED)
        self._usual: Floats | None = None
        self._asked = 0

    @property
    def awake(self) -> bool:
        """Whether a program watches for contacts; `note` is then called in every tick."""
        return self._asked > 0

    def note(self, force: Floats) -> None:
        """Take the force at the tool of a tick, base frame, shape (3,) [N]."""
        self._asked -= 1
        self._forces.append(force)
        if self._usual is None and len(self._forces) == FIRST:
            self._usual = np.mean(self._forces, axis=0)

    def steps(self, direction: Sequence[float], threshold: float, sure: int) -> int:
        """Return the number of ticks since just before a contact began; 0 if there is none.

        The tool meets what it touches in a direction of the base frame, zeros for any. The mean force of
        `sure` ticks must exceed the threshold [N].
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


class ExternalSensor:
    """Takes the place of the arm's own sensor while it is used and not silent; in lockstep it never is."""

    def __init__(self, *, timeouts: bool) -> None:
        self._most = round(SILENT / PERIOD) if timeouts else np.inf
        self._offset: Sequence[float] | None = None
        self.latest: Floats | None = None
        """What it told last; None if that was too long ago."""
        self._age = 0

    def use(self, offset: Sequence[float] | None) -> None:
        """Use it from now on, at an offset from the flange, in its frame, shape (3,) [m].

        None: no more, and what it told does not count any longer.
        """
        self._offset, self.latest = offset, None if offset is None else self.latest

    def sense(self, wrench: Floats) -> None:
        """Take what it measures, in the directions of the flange frame, shape (6,) [N, N m]."""
        self.latest, self._age = wrench, 0

    @property
    def felt(self) -> Floats | None:
        """What it feels about the flange's origin, shape (6,); None if it is not used or has told nothing for long."""
        if self._offset is None or self.latest is None:
            return None
        force, torque = self.latest[:3], self.latest[3:]
        return np.concatenate((force, torque + np.cross(self._offset, force)))

    @property
    def awaited(self) -> bool:
        """Whether the sensor is in use but its last value is missing or too old."""
        return self._offset is not None and self.latest is None

    def next(self) -> Floats | None:
        """Return `felt` of the next tick; needed in each while there is a `latest` value."""
        self._age += 1
        if self._age > self._most:
            self.latest = None
        return self.felt
