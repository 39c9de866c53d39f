"""The reference before shaping, with its derivatives at the tick of the target."""

from tvist_controller.control.differentiator import Differentiator, Floats

REACH = 3
"""Number of references that a central difference of second order uses."""


class UnshapedReference:
    """Central differences of the reference before shaping, as long as they are not those of the shaped one."""

    def __init__(self) -> None:
        self.join()

    def join(self) -> None:
        """Continue from the shaped reference, as a motion that bypasses the filter does, or restart together with it.

        The reference may jump; its derivatives do not know of that.
        """
        self.apart: Differentiator | None = None
        """State of motion of the reference, if one of its last samples was not the shaped one; else None."""
        self._alike = 0

    def push(self, q: Floats, shaped: Differentiator, *, alike: bool) -> Differentiator | None:
        """Take the reference of this tick.

        While `apart` is None, an alike reference need not be passed.

        Args:
            q: Reference before shaping, shape (n,) [rad].
            shaped: State of motion of the shaped reference, before this tick.
            alike: Whether the shaped reference of this tick is the same to the last bit.

        Returns:
            State of motion of which the target of the previous tick is without the filter; None if that is the target
            itself, to the last bit.
        """
        apart = self.apart
        if apart is None:
            apart = self.apart = shaped.fork()
        self._alike = self._alike + 1 if alike else 0
        if self._alike == REACH:
            self.join()
            return None
        apart.push(q)
        return apart
