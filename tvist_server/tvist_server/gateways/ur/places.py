"""How many clients may be connected to a robot's interfaces, and who is disconnected when places run out."""

from collections.abc import Callable
from typing import Final, Generic, Protocol, TypeVar

MOST: Final = 256
"""Largest number of connections to all interfaces of a robot together."""
KEPT: Final = 8
"""Number of places kept for clients on this machine, so that a local user can always connect."""
SCARCE: Final = 0.9
"""Share of the places above which each new client displaces another [-]."""


class Occupant(Protocol):
    """A client that has a place."""

    @property
    def peer(self) -> str:
        """Name of the client in messages to people."""

    @property
    def heard(self) -> float:
        """When the client last sent something; if it never has, when it connected [s]."""

    @property
    def dispensable(self) -> bool:
        """Whether the client may be disconnected for a new one, because nothing is sent to it unless it asks."""

    def cut_off(self) -> None:
        """Close the connection at once."""


AnOccupant = TypeVar("AnOccupant", bound=Occupant)


class Places(Generic[AnOccupant]):
    """Decides which clients may connect.

    When nine places of ten are taken, each new client displaces the dispensable client that has been silent for
    longest. Dispensable are clients of the dashboard, and clients of RTDE that are not being served: RTDE serves a
    client from its start to its pause, and during this time the client may only read. Clients that are being served
    stay connected, and so do those that read from the other interfaces. A new client is turned away only if such
    clients take all places, so a flood of new clients does not disturb those that are working.

    Args:
        now: Returns the time on the same clock as `Occupant.heard` [s].
        note: Takes a sentence for the server's console.
        most: Largest number of connections.
    """

    def __init__(self, now: Callable[[], float], note: Callable[[str], None], most: int = MOST) -> None:
        self.taken: set[AnOccupant] = set()
        """Clients that have a place; each adds and removes itself."""
        self._now = now
        self._note = note
        self._most = most

    def make_room(self, peer: str, *, local: bool) -> bool:
        """Return whether a new client may connect; if necessary, disconnect another one first.

        Args:
            peer: Name of the new client in messages to people.
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
