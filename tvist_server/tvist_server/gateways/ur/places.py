"""How many clients may be connected to a robot's interfaces, and who is disconnected when places run out."""

from collections.abc import Callable
from typing import Final, Generic, Protocol, TypeVar

MOST: Final = 256
"""Connections to all interfaces of a robot together."""
KEPT: Final = 8
"""Number of places kept for clients on this machine, so that a local user can always connect."""
SCARCE: Final = 0.9
"""Share of the places that may be taken before somebody has to go for each newcomer [-]."""


class Occupant(Protocol):
    """A client that has a place."""

    @property
    def peer(self) -> str:
        """Name of the client, for people."""

    @property
    def heard(self) -> float:
        """When it last sent something, or came, if it never has [s]."""

    @property
    def dispensable(self) -> bool:
        """Whether it may have to go for a newcomer: nothing is sent to it unless it asks."""

    def cut_off(self) -> None:
        """End the connection at once."""


AnOccupant = TypeVar("AnOccupant", bound=Occupant)


class Places(Generic[AnOccupant]):
    """Lets clients in.

    When nine places of ten are taken, each newcomer sends away the dispensable client that has been silent for
    longest, counted from when it last sent something. Dispensable are clients of the dashboard, and those of RTDE
    that are not being served: RTDE serves a client from its start to its pause, during which it may well only
    read. Whoever is served stays, and so does whoever reads from the other interfaces. A newcomer is turned away only
    where all places are taken by such clients: a flood of newcomers then disturbs nobody who is at work.

    Args:
        now: The time by which `Occupant.heard` is told [s].
        note: Takes a sentence for the server's console.
        most: Connections.
    """

    def __init__(self, now: Callable[[], float], note: Callable[[str], None], most: int = MOST) -> None:
        self.taken: set[AnOccupant] = set()
        """Everybody who has a place; `Occupant` itself enters and leaves."""
        self._now = now
        self._note = note
        self._most = most

    def make_room(self, peer: str, *, local: bool) -> bool:
        """Whether a newcomer may come in; if need be somebody goes first.

        Args:
            peer: Name of the new client, for people.
            local: Whether it is on this machine.
        """
        if len(self.taken) >= SCARCE * self._most:
            self._send_one_away(peer)
        kept = 0 if local else KEPT
        if len(self.taken) < self._most - kept:
            return True
        self._note(
            f"{peer} was refused: {len(self.taken)} of {self._most} connections are in use"
            + (f", and {KEPT} are kept for this machine" if kept else "")
        )
        return False

    def _send_one_away(self, newcomer: str) -> None:
        silent = min(
            (occupant for occupant in self.taken if occupant.dispensable),
            key=lambda occupant: occupant.heard,
            default=None,
        )
        if silent is None:
            return
        taken = len(self.taken)
        silent.cut_off()
        self.taken.discard(silent)
        self._note(
            f"{silent.peer}, silent for {self._now() - silent.heard:.0f} s, was closed to make room for {newcomer}: "
            f"{taken} of {self._most} connections were in use"
        )
