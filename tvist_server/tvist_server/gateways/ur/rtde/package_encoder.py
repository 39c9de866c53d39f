"""Data packages for RTDE clients. Values are computed once per tick for all recipes, then copied to each."""

from collections.abc import Iterable
from itertools import chain
from struct import Struct, calcsize
from sys import byteorder
from typing import NamedTuple

import numpy as np

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.io import Io
from tvist_server.gateways.ur.rtde.recipes import OutputRecipe
from tvist_server.gateways.ur.rtde.variables import OUTPUTS, PARTS, OutputSource
from tvist_server.rtde.codec import HEADER, PackageKind


class PackageEncoder:
    """Makes data packages, each once for all clients with the same recipe."""

    def __init__(self) -> None:
        self._recipes: dict[object, OutputRecipe] = {}
        self._bytes: _EncodedTick | None = None
        """Bytes of the last tick; None if the recipes have changed since."""
        self._snapshot: Snapshot | None = None
        self._packages: dict[tuple[bytes, str], bytes] = {}  # packages of the last tick, by head and names

    def begin(self, client: object, recipe: OutputRecipe) -> None:
        """Note that a client now reads this valid recipe instead of its previous recipe."""
        self._recipes[client] = recipe
        self._bytes = self._snapshot = None

    def end(self, client: object) -> None:
        if self._recipes.pop(client, None) is not None:
            self._bytes = self._snapshot = None

    def package(self, recipe: OutputRecipe, snapshot: Snapshot, head: bytes) -> bytes:
        """Return the package of a tick for a recipe that a client reads; `head` precedes the variables."""
        try:
            gathered = self._at(snapshot)
        except Exception:  # noqa: BLE001  an error in a variable must only affect its readers
            self._bytes = self._snapshot = None
            alone = _EncodedTick([recipe], snapshot)
            alone.write(snapshot)
            return _package(head, alone.of(recipe))
        key = head, recipe.text
        package = self._packages.get(key)
        if package is None:
            package = self._packages[key] = _package(head, gathered.of(recipe))
        return package

    def _at(self, snapshot: Snapshot) -> "_EncodedTick":
        if self._bytes is None:
            self._bytes = _EncodedTick(self._recipes.values(), snapshot)
        if snapshot is not self._snapshot:
            self._bytes.write(snapshot)
            self._packages.clear()
            self._snapshot = snapshot
        return self._bytes


def _package(head: bytes, data: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(head) + len(data), PackageKind.DATA) + head + data


class _EncodedTick:
    """Encoded variables of some recipes at one tick after another; `snapshot` gives the number of joints."""

    def __init__(self, recipes: Iterable[OutputRecipe], snapshot: Snapshot) -> None:
        different = {recipe.text: recipe for recipe in recipes}.values()
        names = [name for recipe in different for name in recipe.names]
        parts = dict.fromkeys(PARTS[name][0] for name in names)
        self._places: dict[OutputSource, _Place] = {}
        self._of_io = _Packing([part for part in parts if part.of_io], snapshot, 0, self._places)
        self._others = _Packing(
            [part for part in parts if not part.of_io], snapshot, self._of_io.end, self._places
        )
        self._zero = self._others.end
        self._buffer = bytearray(self._zero + 1)
        self._numbers = np.frombuffer(self._buffer, np.uint8)
        self._spans: dict[str, slice] = {}
        """Slice of the gathered bytes that belongs to each recipe, by the text of the recipe."""
        first = 0
        for recipe in different:
            self._spans[recipe.text] = slice(first, first + recipe.size)
            first += recipe.size
        places = {name: np.array(self._places_of(name), np.intp) for name in dict.fromkeys(names)}
        self._index = np.concatenate([places[name] for name in names])
        self._gathered = b""
        self._io: Io | None = None

    def write(self, snapshot: Snapshot) -> None:
        """Encode the values of a tick, and copy them in the order of each recipe."""
        if snapshot.io is not self._io:
            self._of_io.write(snapshot, self._buffer)
            self._io = snapshot.io
        self._others.write(snapshot, self._buffer)
        # The fastest mode; all indices are in range.
        self._gathered = self._numbers.take(self._index, mode="clip").tobytes()

    def of(self, recipe: OutputRecipe) -> bytes:
        return self._gathered[self._spans[recipe.text]]

    def _places_of(self, name: str) -> list[int]:
        """Return the buffer indices of a variable's bytes; zeros fill vectors of fewer than six entries."""
        (part, number), wire = PARTS[name], OUTPUTS[name]
        place, size = self._places[part], wire.size // wire.length
        entries = place.entries // part.variables
        first = [place.first + size * (number * entries + k) for k in range(entries)]
        turned = place.of_machine and byteorder == "little"
        order = range(size - 1, -1, -1) if turned else range(size)
        found = [at + k for at in first for k in order]
        return found + [self._zero] * (wire.size - len(found))


class _Place(NamedTuple):
    first: int
    entries: int
    of_machine: bool  # whether its bytes are in the machine's order


class _Packing:
    """Packs variables into a buffer from index `first`; adds each one's position and length to `places`."""

    def __init__(
        self, parts: list[OutputSource], snapshot: Snapshot, first: int, places: dict[OutputSource, _Place]
    ) -> None:
        found = [(part, part.read(snapshot)) for part in parts]
        lists = [(part, value) for part, value in found if isinstance(value, list)]
        others = [(part, value) for part, value in found if not isinstance(value, list)]
        self._lists, self._others = [part.read for part, _ in lists], [part.read for part, _ in others]
        self._first, self.end, layout = first, first, ">"
        for part, value in (*lists, *others):
            size, raw = calcsize(f">{part.letter}"), isinstance(value, bytes | bytearray)
            entries = len(value) // size if raw else len(value) if isinstance(value, list) else 1
            places[part] = _Place(self.end, entries, raw)
            layout += f"{size * entries}s" if raw else f"{entries}{part.letter}"
            self.end += size * entries
        self._pack_into = Struct(layout).pack_into

    def write(self, snapshot: Snapshot, buffer: bytearray) -> None:
        numbers = chain.from_iterable([read(snapshot) for read in self._lists])
        self._pack_into(buffer, self._first, *numbers, *[read(snapshot) for read in self._others])
