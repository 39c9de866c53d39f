"""The present stream of set-points, and the counts of all streams."""

import math

from tvist_controller.line.differentiator import Floats
from tvist_controller.trajectory import SetpointStream

TIMEOUT = 0.25
"""Time without set-points after which a stream is stopped [s]."""


class Streaming:
    """Follows one stream at a time."""

    def __init__(self) -> None:
        self.stream: SetpointStream | None = None
        """The present stream."""
        self._heard = 0.0
        self._refused: str | None = None
        self._late, self._lost, self._limited = 0, 0, 0

    @property
    def sequence(self) -> int | None:
        """Sequence number of the newest accepted set-point; None without a stream or before its first set-point."""
        return None if self.stream is None else self.stream.sequence

    def begin(self, stream: SetpointStream, now: float) -> None:
        """Follow a stream; takes the present time [s]."""
        self.stream, self._heard, self._refused = stream, now, None

    def offer(self, sequence: int, q: Floats, now: float) -> None:
        """Take a set-point."""
        if self.stream is not None:
            self._heard, self._refused = now, None
            self.stream.offer(sequence, q)

    def refuse(self, why: str) -> None:
        """Remember why a set-point was rejected, to be reported if no valid one follows."""
        self._refused = why

    @property
    def silent_at(self) -> float:
        """Time at which the stream counts as silent unless a set-point comes [s]; infinite without one."""
        # A little early, since sums round: `silence` decides.
        return math.inf if self.stream is None else self._heard + TIMEOUT - 1e-6

    def silence(self, now: float) -> str | None:
        """Return a sentence if set-points have stopped coming; None while they come."""
        if self.stream is None or now - self._heard < TIMEOUT:
            return None
        refused = "" if self._refused is None else f"; the last one was refused: {self._refused}"
        return f"no set-point for {TIMEOUT:g} s{refused}"

    def end(self) -> bool:
        """Stop following the stream, and add up its counts; return whether there was one."""
        if self.stream is None:
            return False
        self._late, self._lost, self._limited = self.counters()
        self.stream = None
        return True

    def counters(self) -> tuple[int, int, int]:
        """Late, lost and limited set-points since the start, including the present stream's."""
        stream = self.stream
        late, lost, limited = (stream.late, stream.lost, stream.limited) if stream else (0, 0, 0)
        return self._late + late, self._lost + lost, self._limited + limited
