"""The package's only array type, and how its objects are copied."""

import copy
from typing import Self, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]


class Forked:
    """Base of objects that can be run ahead in a copy to predict what the original will do."""

    def fork(self) -> Self:
        """Return an independent copy of the present state, whose outputs for equal inputs have the same bits.

        Use it in the same thread as the original.
        """
        other = copy.copy(self)
        other._unshare()  # noqa: SLF001  one of its own kind
        return other

    def _unshare(self) -> None:
        """Replace everything that is modified in place by copies."""
