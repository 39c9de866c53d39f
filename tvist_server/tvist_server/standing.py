"""What others than its own thread may know of a controller."""

from typing import NamedTuple

from tvist_server.planning.basis import Basis
from tvist_server.session import Lease


class Standing(NamedTuple):
    """Of a controller, between two ticks; a new one takes its place, so that any thread may read it."""

    lease: Lease | None
    """Who has control."""
    basis: Basis
    """What plans for commands depend on."""

    @property
    def may_move(self) -> bool:
        """Whether a point-to-point motion may begin."""
        return self.basis.motion is not None
