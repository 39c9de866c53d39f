"""Names and types of inputs (clients set them), outputs (clients read them) and registers."""

from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from functools import cache, partial
from operator import attrgetter
from typing import Any, NamedTuple, get_args

from tvist_controller.instruments.snapshot import Snapshot
from tvist_controller.instruments.variables import VARIABLES
from tvist_controller.instruments.wrench import JOINT_LISTS
from tvist_protocol.io import Bank
from tvist_server.option_values import StartError
from tvist_server.rtde.wire import WireType

NUMBERS = range(48)  # numbers of the integer registers and of the double registers
SINGLE_BITS = range(64, 128)  # bits that are separate variables; bits 0 to 63 are sent in two words of 32
WORDS = ("0_to_31", "32_to_63")  # Suffixes of the names of the two words


def registers(kind: str) -> tuple[tuple[str, WireType], ...]:
    """Return names and types of the variables of a bank, in the order of its registers."""
    if kind.endswith("_bit"):
        words = [(f"{kind}_registers{span}", WireType.UINT32) for span in WORDS]
        return (*words, *[(f"{kind}_register_{number}", WireType.BOOL) for number in SINGLE_BITS])
    wire = WireType.INT32 if kind.endswith("_int") else WireType.DOUBLE
    return tuple((f"{kind}_register_{number}", wire) for number in NUMBERS)


KINDS = [f"{side}_{kind}" for side in ("output", "input") for kind in ("bit", "int", "double")]
"""Prefixes of the names of variables, one for each bank."""

DIGITAL: dict[str, tuple[int, int]] = {"standard": (0, 8), "configurable": (8, 8), "tool": (16, 2)}
"""Groups of digital outputs: number of the first bit, and number of bits."""

NAMED: dict[str, tuple[WireType, str]] = {
    "speed_slider_mask": (WireType.UINT32, "1: use `speed_slider_fraction`."),
    "speed_slider_fraction": (WireType.DOUBLE, "Position of the speed slider, 0 to 1."),
    "standard_digital_output_mask": (WireType.UINT8, "Mask of the eight standard digital outputs to set."),
    "standard_digital_output": (WireType.UINT8, "Values of the standard digital outputs."),
    "configurable_digital_output_mask":
        (WireType.UINT8, "Mask of the eight configurable digital outputs to set."),
    "configurable_digital_output": (WireType.UINT8, "Values of the configurable digital outputs."),
    "tool_digital_output_mask": (WireType.UINT8, "Mask of the tool's two digital outputs to set."),
    "tool_digital_output": (WireType.UINT8, "Values of the tool's digital outputs."),
    "standard_analog_output_mask": (WireType.UINT8, "Mask of the two analogue outputs to set."),
    "standard_analog_output_type":
        (WireType.UINT8, "Type of each analogue output: 0 is current (4–20 mA), 1 voltage (0–10 V)."),
    "standard_analog_output_0":
        (WireType.DOUBLE, "Value of analogue output 0 as a share of its range, 0 to 1."),
    "standard_analog_output_1":
        (WireType.DOUBLE, "Value of analogue output 1 as a share of its range, 0 to 1."),
    "external_force_torque":
        (WireType.VECTOR6D,
         "Wrench measured by an external force sensor, every 100 ms; for programs of its host that use it [N, N m]."),
}  # fmt: skip
"""Type and description of each input variable that is not a register."""

_BITS, _INTS, _DOUBLES = get_args(Bank)[:3]
REGISTERS: dict[str, tuple[Bank, int, WireType]] = (
    {f"input_bit_registers{span}": (_BITS, 32 * k, WireType.UINT32) for k, span in enumerate(WORDS)}
    | {f"input_bit_register_{k}": (_BITS, k, WireType.BOOL) for k in SINGLE_BITS}
    | {f"input_int_register_{k}": (_INTS, k, WireType.INT32) for k in NUMBERS}
    | {f"input_double_register_{k}": (_DOUBLES, k, WireType.DOUBLE) for k in NUMBERS}
)
"""Bank, number of the first register, and type of each variable that sets registers."""

INPUTS: dict[str, WireType] = {name: wire for name, (wire, _) in NAMED.items()} | {
    name: wire for name, (_, _, wire) in REGISTERS.items()
}
"""Type of every input variable by name."""

NEED_CONTROL = frozenset(NAMED) - {"external_force_torque"}
"""Variables that only the client in control may own. Any client may write registers, which are only memory. A
wrench only affects programs of the client in control, and every connection of `ur_rtde` requests it."""


@cache
def matching(patterns: tuple[str, ...]) -> tuple[str, ...]:
    """Return the input variables that match patterns with `*`, `?` and `[0-9]`; StartError if one matches none."""
    found = {pattern: [name for name in INPUTS if fnmatchcase(name, pattern)] for pattern in patterns}
    if wrong := [pattern for pattern, names in found.items() if not names]:
        why = "must be the name of an RTDE input, such as speed_slider_mask or input_int_register_*"
        raise StartError(f"reserve_inputs has {wrong[0]!r}: {why}")
    return tuple(name for names in found.values() for name in names)


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


def _single_bits(bank: str, snapshot: Snapshot) -> list[bool]:
    """Return the bits of a bank that RTDE has as one variable each."""
    words: list[int] = getattr(snapshot.io, bank)
    return [bool(words[number // 32] >> number % 32 & 1) for number in SINGLE_BITS]


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
            read = partial(_single_bits, bank)
            single = OutputSource(read, WireType.BOOL.value, len(SINGLE_BITS), of_io=True)
            yield from ((f"{bank}_{number}", (single, row)) for row, number in enumerate(SINGLE_BITS))


PARTS: dict[str, tuple[OutputSource, int]] = dict(_parts())
"""For each output variable: the `OutputSource` that reads it, and its index among that source's variables."""
