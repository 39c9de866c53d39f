"""Types of variables."""

from collections.abc import Callable, Sequence
from enum import Enum
from struct import Struct
from typing import Any

Encode = Callable[[Any], bytes]
"""From a value to its bytes."""


class Wire(Enum):
    """A type: its word is its name."""

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
        """On the wire [bytes]."""
        return Struct(f">{self.value}").size

    @property
    def length(self) -> int:
        """Numbers in a value; 1 where it is no vector."""
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
