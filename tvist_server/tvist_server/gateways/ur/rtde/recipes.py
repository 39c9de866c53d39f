"""Lists of variables that travel together in one package."""

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
    """Names between commas; clients end their lists with one, or not."""
    text = names.decode("ascii", "replace").removesuffix(",")
    return tuple(name.strip() for name in text.split(",")) if text else ()


class Encoded(dict[str, bytes]):
    """Variables of one tick as bytes, made when first asked for: recipes share most of them."""

    def __init__(self, snapshot: Snapshot) -> None:
        registers = snapshot.kept.setdefault(_SHARED, EncodedRegisters())
        registers.update_from(snapshot.io)
        super().__init__(registers)
        self._snapshot = snapshot
        self.packages: dict[tuple[bytes, tuple[str, ...]], bytes] = {}
        """Whole packages by head and names: clients with the same recipe share them."""

    def __missing__(self, name: str) -> bytes:
        read, encode = READERS[name]
        data = self[name] = encode(read(self._snapshot))
        return data

    @classmethod
    def of(cls, snapshot: Snapshot) -> "Encoded":
        """The one of this snapshot."""
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
        """Types, or what is wrong."""
        self._names = names
        self._fields: Callable[[Encoded], Iterable[bytes]]
        self.valid = bool(names) and "NOT_FOUND" not in self.words
        """Whether there are packages of it: each variable exists, and all fit into one package."""
        if self.valid:
            one = names[0]
            self._fields = itemgetter(*names) if len(names) > 1 else lambda encoded: (encoded[one],)
            self._size = sum(OUTPUTS[name].size for name in names)
            self.valid = HEADER.size + 1 + self._size <= LARGEST

    def package(self, snapshot: Snapshot, head: bytes) -> bytes:
        """One data package.

        Args:
            snapshot: Values of the tick.
            head: What comes before the variables: the recipe's id, where the protocol has one.
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
        """What a package says: of one that is too short the variables that are whole, of one too long its beginning."""
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
