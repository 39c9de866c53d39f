"""Recipes: lists of variables that are sent in one data package."""

from collections.abc import Callable, Iterable
from operator import itemgetter
from struct import Struct

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.rtde.codec import HEADER, LARGEST, PackageKind
from tvist_server.gateways.ur.rtde.inputs import INPUTS
from tvist_server.gateways.ur.rtde.outputs import OUTPUTS, READERS
from tvist_server.gateways.ur.rtde.registers import EncodedRegisters
from tvist_server.gateways.ur.rtde.wire import Wire

Value = int | float | tuple[float, ...]
"""Value of an input variable."""

_SHARED = "rtde"


def split(names: bytes) -> tuple[str, ...]:
    """Return the names of a list that is separated by commas; a comma at its end is ignored."""
    text = names.decode("ascii", "replace").removesuffix(",")
    return tuple(name.strip() for name in text.split(",")) if text else ()


class Encoded(dict[str, bytes]):
    """Bytes of one tick's variables by name, each encoded once for all recipes, when the first one needs it."""

    def __init__(self, snapshot: Snapshot) -> None:
        registers = snapshot.kept.setdefault(_SHARED, EncodedRegisters())
        registers.update_from(snapshot.io)
        super().__init__(registers)
        self._snapshot = snapshot
        self.packages: dict[tuple[bytes, tuple[str, ...]], bytes] = {}
        """Complete data packages by head and names, for clients with the same recipe."""

    def __missing__(self, name: str) -> bytes:
        read, encode = READERS[name]
        data = self[name] = encode(read(self._snapshot))
        return data

    @classmethod
    def of(cls, snapshot: Snapshot) -> "Encoded":
        """Return the encoded variables of a snapshot, which all clients share."""
        encoded = snapshot.shared.get(_SHARED)
        if encoded is None:
            encoded = snapshot.shared[_SHARED] = cls(snapshot)
        assert isinstance(encoded, cls)
        return encoded


class OutputRecipe:
    """Variables that a client reads.

    Args:
        names: Names of output variables, as the client wrote them.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.words = [OUTPUTS[name].name if name in OUTPUTS else "NOT_FOUND" for name in names]
        """Type of each variable, or `NOT_FOUND`."""
        self._names = names
        self._fields: Callable[[Encoded], Iterable[bytes]]
        self.valid = bool(names) and "NOT_FOUND" not in self.words
        """Whether each variable exists and all of them fit into one package."""
        if self.valid:
            one = names[0]
            self._fields = itemgetter(*names) if len(names) > 1 else lambda encoded: (encoded[one],)
            self._size = sum(OUTPUTS[name].size for name in names)
            self.valid = HEADER.size + 1 + self._size <= LARGEST

    def package(self, snapshot: Snapshot, head: bytes) -> bytes:
        """Return the data package of a tick.

        Args:
            snapshot: Values of the tick.
            head: Bytes in front of the variables: the recipe's id in protocol version 2, nothing in version 1.
        """
        encoded = Encoded.of(snapshot)
        key = head, self._names
        package = encoded.packages.get(key)
        if package is None:
            size = HEADER.size + len(head) + self._size
            package = HEADER.pack(size, PackageKind.DATA) + head + b"".join(self._fields(encoded))
            encoded.packages[key] = package
        return package


class InputRecipe:
    """Variables that a client writes.

    Args:
        names: Names of input variables, all of which exist.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._fields = [(name, INPUTS[name]) for name in names]
        self._all = Struct(">" + "".join(wire.value for _, wire in self._fields))

    def values(self, data: bytes) -> dict[str, Value]:
        """Return the value of each variable in the payload of a data package.

        Variables that a short payload does not contain completely are missing; bytes after the last one are ignored.
        """
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


def _collect(fields: list[tuple[str, Wire]], numbers: tuple[int | float, ...]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    at = 0
    for name, wire in fields:
        length = wire.length
        values[name] = numbers[at] if length == 1 else numbers[at : at + length]
        at += length
    return values
