"""Recipes: lists of variables that are sent in one data package."""

from itertools import accumulate, islice
from struct import Struct

from tvist_server.gateways.ur.rtde.variables import INPUTS, OUTPUTS
from tvist_server.rtde.codec import HEADER, LARGEST

Value = int | float | tuple[float, ...]


def split(names: bytes) -> tuple[str, ...]:
    """Return the names in a list separated by commas; a trailing comma is ignored."""
    text = names.decode("ascii", "replace").removesuffix(",")
    return tuple(name.strip() for name in text.split(",")) if text else ()


class OutputRecipe:
    """Variables that a client reads."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.words = [OUTPUTS[name].name if name in OUTPUTS else "NOT_FOUND" for name in names]
        """Type of each variable, or `NOT_FOUND`."""
        self.names = names  # the variables' names as the client wrote them
        self.text = ",".join(names)
        self.size = 0  # size of all of them [bytes]
        self.valid = bool(names) and "NOT_FOUND" not in self.words
        """Whether every variable exists and all of them fit into one package."""
        if self.valid:
            self.size = sum(OUTPUTS[name].size for name in names)
            self.valid = HEADER.size + 1 + self.size <= LARGEST


class InputRecipe:
    """Variables that a client writes, all of which exist."""

    def __init__(self, names: tuple[str, ...]) -> None:
        wires = [INPUTS[name] for name in names]
        ends = accumulate(wire.size for wire in wires)
        self._fields = [(name, wire.length, end) for name, wire, end in zip(names, wires, ends, strict=True)]
        self._layout = Struct(">" + "".join(wire.value for wire in wires))

    def values(self, data: bytes) -> dict[str, Value]:
        """Return the values in a data package, without variables that a short payload lacks."""
        numbers = iter(self._layout.unpack_from(data.ljust(self._layout.size, b"\0")))
        values: dict[str, Value] = {}
        for name, length, end in self._fields:
            if end > len(data):
                break
            values[name] = next(numbers) if length == 1 else tuple(islice(numbers, length))
        return values
