"""Types of RTDE's variables, and their bytes."""

from collections.abc import Callable, Sequence
from enum import Enum
from struct import Struct
from typing import Any

Encode = Callable[[Any], bytes]
"""Function that returns the bytes of a value."""


class Wire(Enum):
    """A type by its name in RTDE; the value is its format in `struct`, without the byte order."""

    BOOL = "?"
    UINT8 = "B"
    UINT32 = "I"
    UINT64 = "Q"
    INT32 = "i"
    DOUBLE = "d"
    VECTOR3D = "3d"
    VECTOR6D = "6d"
    VECTOR6INT32 = "6i"
    VECTOR6UINT32 = "6I"

    @property
    def size(self) -> int:
        """Size of a value [bytes]."""
        return Struct(f">{self.value}").size

    @property
    def length(self) -> int:
        """Number of entries of a vector; 1 for a type that is no vector."""
        return int(self.value[:-1] or 1)

    @property
    def encode(self) -> Encode:
        """Function that writes a value as bytes.

        A vector that is too short is filled with zeros, since clients expect six entries of an arm with fewer joints.
        One that is too long is an error: robots with more joints are refused before they are served, see `UrPorts`.
        """
        pack, length = Struct(f">{self.value}").pack, self.length
        if length == 1:
            return pack

        def vector(values: Sequence[float]) -> bytes:
            if len(values) == length:
                return pack(*values)
            return pack(*values, *[0] * (length - len(values)))

        return vector
