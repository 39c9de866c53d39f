"""Output variables, which clients read: the annotated properties of a snapshot, and the registers."""

from collections.abc import Callable, Iterator
from operator import attrgetter
from struct import calcsize
from typing import Any, NamedTuple

from tvist_controller.instruments.snapshot import VARIABLES, Snapshot
from tvist_server.gateways.ur.rtde.registers import KINDS, SINGLE_BITS, registers
from tvist_server.gateways.ur.rtde.wire import Wire

OUTPUTS: dict[str, Wire] = {name: Wire[word] for name, word in VARIABLES.items()} | {
    name: wire for kind in KINDS for name, wire in registers(kind)
}
"""Type of every output variable by name."""


class Part(NamedTuple):
    """What is written at once: a variable, or all registers of a bank that have the same type."""

    read: Callable[[Snapshot], Any]
    """Returns its value: a list if it has several numbers."""
    letter: str
    """Format of a number in `struct`."""
    numbers: int
    """How many numbers clients expect; an arm with fewer joints has fewer."""

    @property
    def size(self) -> int:
        """Size of a number [bytes]."""
        return calcsize(f">{self.letter}")


def _single_bits(bank: str) -> Callable[[Snapshot], list[bool]]:
    """Return a function that returns the bits of a bank that are variables of their own."""

    def read(snapshot: Snapshot) -> list[bool]:
        words: list[int] = getattr(snapshot.io, bank)
        return [bool(words[number // 32] >> number % 32 & 1) for number in SINGLE_BITS]

    return read


def _parts() -> Iterator[tuple[str, tuple[Part, int]]]:
    for name, word in VARIABLES.items():
        wire = Wire[word]
        yield name, (Part(attrgetter(name), wire.value[-1], wire.length), 0)
    for kind in KINDS:
        bank = f"{kind}_register"
        names = [name for name, _ in registers(kind)]
        whole = Part(
            attrgetter(f"io.{bank}"), OUTPUTS[names[0]].value, 4 if kind.endswith("_bit") else len(names)
        )
        bits = Part(_single_bits(bank), Wire.BOOL.value, len(SINGLE_BITS))
        for number, name in enumerate(names):
            single = OUTPUTS[name] is Wire.BOOL
            yield name, (bits, number - len(names) + len(SINGLE_BITS)) if single else (whole, number)


PARTS: dict[str, tuple[Part, int]] = dict(_parts())
"""Part in which each output variable is written, and its number in there."""
