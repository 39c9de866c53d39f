"""What the RTDE clients of a robot read: every value is written once a tick, and every recipe gathers its bytes there.

What no recipe names is not computed.
"""

from collections.abc import Iterable
from itertools import chain
from struct import Struct, calcsize

import numpy as np

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.rtde.codec import HEADER, PackageKind
from tvist_server.gateways.ur.rtde.outputs import OUTPUTS, PARTS, Part
from tvist_server.gateways.ur.rtde.recipes import OutputRecipe


class Board:
    """Makes data packages, each once for all clients with the same recipe."""

    def __init__(self) -> None:
        self._recipes: dict[object, OutputRecipe] = {}
        self._bytes: _Bytes | None = None
        """Bytes of the last tick; None if the recipes have changed since."""
        self._snapshot: Snapshot | None = None
        """Snapshot of the last tick."""
        self._packages: dict[tuple[bytes, str], bytes] = {}
        """Packages of the last tick by head and names."""

    def begin(self, client: object, recipe: OutputRecipe) -> None:
        """Note that a client reads a recipe, which is valid, instead of what it read before."""
        self._recipes[client] = recipe
        self._bytes = self._snapshot = None

    def end(self, client: object) -> None:
        """Note that a client reads nothing more."""
        if self._recipes.pop(client, None) is not None:
            self._bytes = self._snapshot = None

    def package(self, recipe: OutputRecipe, snapshot: Snapshot, head: bytes) -> bytes:
        """Return the data package of a tick.

        Args:
            recipe: A recipe that a client reads.
            snapshot: Values of the tick.
            head: Bytes in front of the variables: the recipe's id in protocol version 2, nothing in version 1.
        """
        if self._bytes is None:
            self._bytes = _Bytes((name for one in self._recipes.values() for name in one.names), snapshot)
        if snapshot is not self._snapshot:
            self._bytes.write(snapshot)
            self._packages.clear()
            self._snapshot = snapshot
        key = head, recipe.text
        package = self._packages.get(key)
        if package is None:
            size = HEADER.size + len(head) + recipe.size
            package = HEADER.pack(size, PackageKind.DATA) + head + self._bytes.of(recipe)
            self._packages[key] = package
        return package


class _Bytes:
    """Bytes of the variables that some recipes name, one behind the other.

    Args:
        names: The variables; one may occur several times.
        snapshot: Tells how many joints the arm has. Vectors of fewer than six are filled with zeros, since clients
            expect six; robots with more joints are refused before they are served, see `UrPorts`.
    """

    def __init__(self, names: Iterable[str], snapshot: Snapshot) -> None:
        parts = dict.fromkeys(PARTS[name][0] for name in names)
        several = [part for part in parts if part.numbers > 1]
        single = [part for part in parts if part.numbers == 1]
        self._several, self._single = [part.read for part in several], [part.read for part in single]
        self._places: dict[Part, int] = {}
        at, layout = 0, ">"
        for part in (*several, *single):
            self._places[part] = at
            given = len(part.read(snapshot)) if part.numbers > 1 else 1
            layout += f"{given}{part.letter}{part.size * (part.numbers - given)}x"
            at += part.size * part.numbers
        self._pack_into = Struct(layout).pack_into
        self._buffer = bytearray(calcsize(layout))
        self._numbers = np.frombuffer(self._buffer, np.uint8)
        self._indices: dict[str, np.ndarray[tuple[int], np.dtype[np.intp]]] = {}

    def write(self, snapshot: Snapshot) -> None:
        """Write the values of a tick."""
        several = chain.from_iterable([read(snapshot) for read in self._several])
        self._pack_into(self._buffer, 0, *several, *[read(snapshot) for read in self._single])

    def of(self, recipe: OutputRecipe) -> bytes:
        """Return the bytes of the variables of a recipe."""
        index = self._indices.get(recipe.text)
        if index is None:
            index = self._indices[recipe.text] = np.concatenate([self._index(name) for name in recipe.names])
        return self._numbers.take(index, mode="clip").tobytes()  # the quickest mode; all places are inside

    def _index(self, name: str) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        part, number = PARTS[name]
        first = self._places[part] + part.size * number
        return np.arange(first, first + OUTPUTS[name].size)
