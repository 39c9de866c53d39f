"""Registers: what their variables are called, and their bytes, kept from tick to tick."""

from collections.abc import Sequence
from struct import Struct

from tvist_protocol.io import Io
from tvist_server.gateways.ur.rtde.wire import Wire

NUMBERS = range(48)
"""Registers of integers, and of doubles."""
SINGLE_BITS = range(64, 128)
"""Bits that are variables of their own; the others come as words."""
WORDS = ("0_to_31", "32_to_63")
"""Ends of the words' names."""


def registers(kind: str) -> tuple[tuple[str, Wire], ...]:
    """Names and types of the variables of a bank, in its order."""
    if kind.endswith("_bit"):
        words = [(f"{kind}_registers{span}", Wire.UINT32) for span in WORDS]
        return (*words, *[(f"{kind}_register_{number}", Wire.BOOL) for number in SINGLE_BITS])
    wire = Wire.INT32 if kind.endswith("_int") else Wire.DOUBLE
    return tuple((f"{kind}_register_{number}", wire) for number in NUMBERS)


KINDS = [f"{side}_{kind}" for side in ("output", "input") for kind in ("bit", "int", "double")]
"""Banks by the beginning of their variables' names."""
_BANKS = {
    f"{kind}_register": ([name for name, _ in registers(kind)], Struct(">" + layout))
    for kind, layout in zip(KINDS, ("4I", f"{len(NUMBERS)}i", f"{len(NUMBERS)}d") * 2, strict=True)
}
"""Names of a bank's variables, and its bytes as a whole, by its name in `Io`."""
_BITS = (b"\x00", b"\x01")


class EncodedRegisters(dict[str, bytes]):
    """Registers as bytes by name. They change seldom, and then a bank at a time: only that is cut up anew."""

    def __init__(self) -> None:
        super().__init__()
        self._io: Io | None = None
        self._seen: dict[str, bytes] = {}

    def update_from(self, io: Io) -> None:
        """Take over what has changed."""
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
    """Bytes of each variable of a bank."""
    size = len(data) // len(values)
    numbers = [data[at : at + size] for at in range(0, len(data), size)]
    if len(values) == len(NUMBERS):
        return numbers
    return numbers[: len(WORDS)] + [_BITS[int(values[k // 32]) >> k % 32 & 1] for k in SINGLE_BITS]
