"""A user's own force sensor, and contact detection from the force at the tool."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_plant.plant import PERIOD

REMEMBERED = 500  # ticks recorded, and after which an unused watch ends
FIRST = 20  # ticks at the start of a watch averaged as the force without contact
ONSET = 0.2  # fraction of the threshold that marks the start of a contact [-]
SILENT = 0.1  # time without values after which the sensor counts as silent [s]


class ContactWatch:
    """Records the force at the tool from the first query on, and finds the start of a contact."""

    def __init__(self) -> None:
        self._forces = deque[Floats](maxlen=REMEMBERED)
        self._usual: Floats | None = None
        self._asked = 0

    @property
    def awake(self) -> bool:
        """Whether a program watches for contacts; `note` is then called every tick."""
        return self._asked > 0

    def note(self, force: Floats) -> None:
        """Take the force at the tool of a tick, base frame, shape (3,) [N]."""
        self._asked -= 1
        self._forces.append(force)
        if self._usual is None and len(self._forces) == FIRST:
            self._usual = np.mean(self._forces, axis=0)

    def steps(self, direction: Sequence[float], threshold: float, sure: int) -> int:
        """Return the ticks since just before a contact began; 0 if there is none.

        `direction` is the tool's motion towards the contact, base frame, zeros for any. The mean of `sure`
        ticks must exceed `threshold` [N].
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
    """Replaces the arm's sensor while in use and not silent; in lockstep it never counts as silent."""

    def __init__(self, *, timeouts: bool) -> None:
        self._most = round(SILENT / PERIOD) if timeouts else np.inf
        self._offset: Sequence[float] | None = None
        self.latest: Floats | None = None  # last value; None if too old
        self._age = 0

    def use(self, offset: Sequence[float] | None) -> None:
        """Use the sensor at an offset from the flange, in its frame, shape (3,) [m]; None to end."""
        self._offset, self.latest = offset, None if offset is None else self.latest

    def sense(self, wrench: Floats) -> None:
        """Take a reading in flange axes, shape (6,) [N, N m]."""
        self.latest, self._age = wrench, 0

    @property
    def felt(self) -> Floats | None:
        """Reading about the flange's origin, shape (6,); None if unused or silent."""
        if self._offset is None or self.latest is None:
            return None
        force, torque = self.latest[:3], self.latest[3:]
        return np.concatenate((force, torque + np.cross(self._offset, force)))

    @property
    def awaited(self) -> bool:
        """Whether the sensor is in use but has no recent value."""
        return self._offset is not None and self.latest is None

    def next(self) -> Floats | None:
        """Return `felt` for the next tick; call in each while there is a `latest` value."""
        self._age += 1
        if self._age > self._most:
            self.latest = None
        return self.felt
