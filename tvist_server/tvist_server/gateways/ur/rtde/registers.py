"""Registers: names and types of their variables."""

from tvist_server.rtde.wire import Wire

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
