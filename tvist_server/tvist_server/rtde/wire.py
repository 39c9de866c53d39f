"""Types of RTDE variables, and their bytes."""

from enum import Enum
from struct import Struct
from typing import NamedTuple


class WireType(Enum):
    """A type by its name in RTDE; the value is its format in `struct`, without byte order."""

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
        """Number of entries of a vector; 1 for other types."""
        return int(self.value[:-1] or 1)


class Field(NamedTuple):
    """Type and range of a variable that is read."""

    wire: WireType
    least: float = -(2.0**63)
    most: float = 2.0**63
