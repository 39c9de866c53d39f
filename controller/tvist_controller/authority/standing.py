"""The part of a controller's state that other threads may read: which clients have rights."""

from typing import NamedTuple

from tvist_controller.authority.session import Lease
from tvist_controller.authority.stepping import ClockHold


class Standing(NamedTuple):
    """State of a controller between two ticks; a new one replaces it, so that any thread may read it."""

    lease: Lease | None
    """Lease of the client that has control."""
    clock: ClockHold | None
    """Hold of the client that has the clock."""

    def sessions_of(self, client: str) -> set[str | None]:
        """Sessions whose end takes control or the clock from a client; empty if it has neither."""
        rights = (self.lease, self.clock)
        return {right.session for right in rights if right is not None and right.client == client}
