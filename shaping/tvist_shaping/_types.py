"""The package's only array type, and how its objects are copied."""

import copy
from typing import Self, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]


class Forkable:
    """Base of objects that can be run ahead in a copy to predict what the original will do."""

    def fork(self) -> Self:
        """Return an independent copy of the present state, whose outputs for equal inputs have the same bits.

        Use it in the thread of the original. All its arrays and `Forkable` attributes are copied.
        """
        other = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                vars(other)[name] = value.copy()
            elif isinstance(value, Forkable):
                vars(other)[name] = value.fork()
        return other
