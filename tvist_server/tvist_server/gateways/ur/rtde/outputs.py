"""Output variables, which clients read, including registers."""

from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any, NamedTuple

from tvist_controller.instruments.snapshot import Snapshot
from tvist_controller.instruments.variables import VARIABLES
from tvist_controller.instruments.wrench import JOINT_LISTS
from tvist_server.gateways.ur.rtde.inputs import KINDS, SINGLE_BITS, registers
from tvist_server.rtde.wire import WireType

OUTPUTS: dict[str, WireType] = {name: WireType[one.type] for name, one in VARIABLES.items()} | {
    name: wire for kind in KINDS for name, wire in registers(kind)
}
"""Type of every output variable by name."""


class OutputSource(NamedTuple):
    """One variable, or several with the same number of entries that are read together."""

    read: Callable[[Snapshot], Any]
    """Returns a number, a list of numbers, or doubles as bytes in the machine's order."""
    letter: str  # format of an entry in `struct`
    variables: int = 1  # number of variables
    of_io: bool = False  # whether its values depend only on terminals and registers, which rarely change


def _single_bits(bank: str) -> Callable[[Snapshot], list[bool]]:
    """Return a function that returns the bits of a bank that are separate variables."""

    def read(snapshot: Snapshot) -> list[bool]:
        words: list[int] = getattr(snapshot.io, bank)
        return [bool(words[number // 32] >> number % 32 & 1) for number in SINGLE_BITS]

    return read


def _parts() -> Iterator[tuple[str, tuple[OutputSource, int]]]:
    for name, one in VARIABLES.items():
        # Computed values may have other readers: the snapshot caches them.
        read = attrgetter(name) if one.source == "computed" else one.read
        yield name, (OutputSource(read, WireType[one.type].value[-1], of_io=one.source == "io"), 0)
    joints = OutputSource(attrgetter("joint_lists"), "d", len(JOINT_LISTS))
    yield from ((name, (joints, row)) for row, name in enumerate(JOINT_LISTS))
    tool = OutputSource(lambda snapshot: snapshot.target.tobytes(), "d", 3)
    yield from (
        (f"target_TCP_{name}", (tool, row)) for row, name in enumerate(("pose", "speed", "acceleration"))
    )
    for kind in KINDS:
        bank, bits = f"{kind}_register", kind.endswith("_bit")
        words = [name for name, wire in registers(kind) if wire is not WireType.BOOL]
        whole = OutputSource(
            attrgetter(f"io.{bank}"), OUTPUTS[words[0]].value, 4 if bits else len(words), of_io=True
        )
        yield from ((name, (whole, row)) for row, name in enumerate(words))
        if bits:
            single = OutputSource(_single_bits(bank), WireType.BOOL.value, len(SINGLE_BITS), of_io=True)
            yield from ((f"{bank}_{number}", (single, row)) for row, number in enumerate(SINGLE_BITS))


PARTS: dict[str, tuple[OutputSource, int]] = dict(_parts())
"""OutputSource with which each output variable is read, and its index in that part."""
