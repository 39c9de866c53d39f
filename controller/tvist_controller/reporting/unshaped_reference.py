"""The reference before shaping, with its derivatives at the tick of the target: what the arm would do unshaped."""

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.sample import Sample

REACH = 3
"""Number of references that a central difference of second order uses."""


class UnshapedReference:
    """Central differences of the reference before shaping, as long as they are not those of the shaped one."""

    def __init__(self) -> None:
        self._apart: tuple[Floats, Floats, Floats] | None = None
        """The last three references, if one of the last samples was not the shaped one; else None."""
        self._alike = 0

    def join(self) -> None:
        """Continue from the shaped reference, since the arm was put at rest; the reference may have jumped."""
        self._apart, self._alike = None, 0

    def of(self, sample: Sample) -> tuple[Floats, Floats, Floats] | None:
        """Take a tick, and return the three references before shaping around the tick of its target, the newest last.

        A motion that bypasses the filter continues the shaped reference, so from its beginning both are the same; the
        derivatives do not know of the reference's jump.

        Returns:
            None if the target itself is that, to the last bit.
        """
        reference, (before, middle, shaped) = sample.reference, sample.window
        if not sample.mode.shaped:
            self.join()
            return None
        # Comparing bytes is several times as fast as comparing arrays.
        alike = reference is shaped or reference.tobytes() == shaped.tobytes()
        if alike and self._apart is None:
            return None
        self._alike = self._alike + 1 if alike else 0
        if self._alike == REACH:
            self.join()
            return None
        if self._apart is not None:
            _, before, middle = self._apart
        self._apart = before, middle, reference
        return self._apart
