"""Recipes: lists of variables that are sent in one data package."""

from struct import Struct

from tvist_server.gateways.ur.rtde.inputs import INPUTS
from tvist_server.gateways.ur.rtde.outputs import OUTPUTS
from tvist_server.rtde.codec import HEADER, LARGEST
from tvist_server.rtde.wire import WireType

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
        self._fields = [(name, INPUTS[name]) for name in names]
        self._all = Struct(">" + "".join(wire.value for _, wire in self._fields))

    def values(self, data: bytes) -> dict[str, Value]:
        """Return the values in a data package, without variables that a short payload lacks."""
        if len(data) >= self._all.size:
            numbers, fields = self._all.unpack_from(data), self._fields
        else:
            fields, size = [], 0
            for name, wire in self._fields:
                if size + wire.size > len(data):
                    break
                size += wire.size
                fields.append((name, wire))
            whole = Struct(">" + "".join(wire.value for _, wire in fields))
            numbers = whole.unpack_from(data)
        return _collect(fields, numbers)


def _collect(fields: list[tuple[str, WireType]], numbers: tuple[int | float, ...]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    at = 0
    for name, wire in fields:
        length = wire.length
        values[name] = numbers[at] if length == 1 else numbers[at : at + length]
        at += length
    return values
