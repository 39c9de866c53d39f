"""Registers: names of their variables, and their bytes, which are kept from tick to tick."""

from collections.abc import Sequence
from struct import Struct

from tvist_protocol.io import Io
from tvist_server.gateways.ur.rtde.wire import Wire

NUMBERS = range(48)
"""Numbers of the integer registers; the double registers have the same."""
SINGLE_BITS = range(64, 128)
"""Bits that are variables of their own; bits 0 to 63 are sent in two words of 32."""
WORDS = ("0_to_31", "32_to_63")
"""Suffixes of the names of the two words."""


def registers(kind: str) -> tuple[tuple[str, Wire], ...]:
    """Return names and types of the variables of a bank, in the order of its registers."""
    if kind.endswith("_bit"):
        words = [(f"{kind}_registers{span}", Wire.UINT32) for span in WORDS]
        return (*words, *[(f"{kind}_register_{number}", Wire.BOOL) for number in SINGLE_BITS])
    wire = Wire.INT32 if kind.endswith("_int") else Wire.DOUBLE
    return tuple((f"{kind}_register_{number}", wire) for number in NUMBERS)


KINDS = [f"{side}_{kind}" for side in ("output", "input") for kind in ("bit", "int", "double")]
"""Prefixes of the names of variables, one for each bank."""
_BANKS = {
    f"{kind}_register": ([name for name, _ in registers(kind)], Struct(">" + layout))
    for kind, layout in zip(KINDS, ("4I", f"{len(NUMBERS)}i", f"{len(NUMBERS)}d") * 2, strict=True)
}
"""Names of the variables of each bank, and the format of the whole bank, by its field in `Io`."""
_BITS = (b"\x00", b"\x01")


class EncodedRegisters(dict[str, bytes]):
    """Bytes of each register variable by name. Registers rarely change: only a bank that has is encoded again."""

    def __init__(self) -> None:
        super().__init__()
        self._io: Io | None = None
        self._seen: dict[str, bytes] = {}

    def update_from(self, io: Io) -> None:
        """Encode the banks that differ from the last call."""
        if io is self._io:
            return
        self._io = io
        for bank, (names, whole) in _BANKS.items():
            values: list[int] | list[float] = getattr(io, bank)
            data = whole.pack(*values)
            if data != self._seen.get(bank):
                self._seen[bank] = data
                self.update(zip(names, _cut(data, values), strict=True))


def _cut(data: bytes, values: Sequence[float]) -> list[bytes]:
    """Return the bytes of each variable of a bank."""
    size = len(data) // len(values)
    numbers = [data[at : at + size] for at in range(0, len(data), size)]
    if len(values) == len(NUMBERS):
        return numbers
    return numbers[: len(WORDS)] + [_BITS[int(values[k // 32]) >> k % 32 & 1] for k in SINGLE_BITS]
