"""A stream of set-points that is followed, and what was counted of all streams."""

from tvist_controller.control.differentiator import Floats
from tvist_controller.trajectory import SetpointStream

TIMEOUT = 0.25
"""A stream without set-points for this long is stopped [s]."""


class Streaming:
    """Follows one stream at a time."""

    def __init__(self) -> None:
        self.stream: SetpointStream | None = None
        """The one that is followed."""
        self._heard = 0.0
        self._refused: str | None = None
        self._late, self._lost, self._limited = 0, 0, 0

    @property
    def sequence(self) -> int | None:
        """Newest set-point taken in; None without a stream, or before its first."""
        return None if self.stream is None else self.stream.sequence

    def begin(self, stream: SetpointStream, now: float) -> None:
        """Follow a stream from a time on [s]."""
        self.stream, self._heard, self._refused = stream, now, None

    def offer(self, sequence: int, q: Floats, now: float) -> None:
        """Take a set-point."""
        if self.stream is not None:
            self._heard, self._refused = now, None
            self.stream.offer(sequence, q)

    def refuse(self, why: str) -> None:
        """Remember why a set-point was not taken: where none follows that is, this is what went wrong."""
        self._refused = why

    def silence(self, now: float) -> str | None:
        """In words, that set-points have failed to come; None while they come."""
        if self.stream is None or now - self._heard < TIMEOUT:
            return None
        refused = "" if self._refused is None else f"; the last one was refused: {self._refused}"
        return f"no set-point for {TIMEOUT:g} s{refused}"

    def end(self) -> bool:
        """Follow it no longer, and keep its counts; whether there was one."""
        if self.stream is None:
            return False
        self._late, self._lost, self._limited = self.counters()
        self.stream = None
        return True

    def counters(self) -> tuple[int, int, int]:
        """Late, lost and limited set-points since the start, the present stream's included."""
        stream = self.stream
        late, lost, limited = (stream.late, stream.lost, stream.limited) if stream else (0, 0, 0)
        return self._late + late, self._lost + lost, self._limited + limited
