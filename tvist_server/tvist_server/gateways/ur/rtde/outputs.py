"""Output variables, which clients read: the annotated properties of a snapshot, and the registers."""

from collections.abc import Callable
from operator import attrgetter
from typing import Any

from tvist_controller.instruments.snapshot import VARIABLES, Snapshot
from tvist_server.gateways.ur.rtde.registers import KINDS, registers
from tvist_server.gateways.ur.rtde.wire import Encode, Wire

Read = Callable[[Snapshot], Any]
"""Function that returns the value of a variable."""

READERS: dict[str, tuple[Read, Encode]] = {
    name: (attrgetter(name), Wire[word].encode) for name, word in VARIABLES.items()
}
"""Functions that read and encode each variable but the registers, of which `EncodedRegisters` encodes whole banks."""
OUTPUTS: dict[str, Wire] = {name: Wire[word] for name, word in VARIABLES.items()} | {
    name: wire for kind in KINDS for name, wire in registers(kind)
}
"""Type of every output variable by name."""
