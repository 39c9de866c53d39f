"""A filter that fails when its shaper's function does, so that no figure is based on old weights."""

from tvist_lab.recordings import Floats
from tvist_shaping.base import Filter


class ShaperFaultError(Exception):
    """A shaper cannot be ranked; the message says why."""


class Sound:
    """A filter in operation.

    Args:
        tvist: The filter.
    """

    def __init__(self, tvist: Filter) -> None:
        self._tvist = tvist

    def __call__(self, q: Floats) -> Floats:
        """Return the next shaped sample, shape (n,) [rad].

        Raises:
            ShaperFaultError: The shaper's function fails.
        """
        return self._checked(self._tvist.filter(q))

    def all(self, q: Floats) -> Floats:
        """Return the next shaped samples, shape (T, n) [rad], equal to those one by one.

        Raises:
            ShaperFaultError: The shaper's function fails at the last of them.
        """
        return self._checked(self._tvist.filter_all(q))

    def _checked(self, shaped: Floats) -> Floats:
        if self._tvist.fault is not None:
            raise ShaperFaultError(self._tvist.fault)
        return shaped
