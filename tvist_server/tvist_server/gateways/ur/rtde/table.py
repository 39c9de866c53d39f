"""`python -m tvist_server.gateways.ur.rtde.table`: prints docs/reference/rtde-variables.md."""

from collections.abc import Iterable

from tvist_controller.instruments.variables import VARIABLES
from tvist_server.gateways.ur.rtde.inputs import NAMED as NAMED_INPUTS
from tvist_server.rtde.wire import Wire

HEAD = """\
# RTDE's variables

For whoever reads or writes variables of RTDE, and asks where a value comes from. Nothing here was measured on a robot.
Made by `python -m tvist_server.gateways.ur.rtde.table > docs/reference/rtde-variables.md`. Each output has one of four
sources:

- **state**: the value that every client gets in [`state`](generated/protocol.md#state), equal to the last bit;
- **io**: terminals, registers and the setup of the tool;
- **computed**: computed from state and io, as the last column says, when a client asks for it;
- **constant**: takes the place of something that is not simulated.

Torque constants, resistances and thermal parameters of the motors are guesses of the right size for a UR5e, which has
two sizes of joint: 10 and 7.9 N m/A on the joint's side. Temperatures and energies are integrated from the first tick
on, even if no client reads them.

Vectors of joints have six entries: an arm with fewer joints has zeros in the rest, and one with more
[has no RTDE](../how-to/connect-ur-clients.md#arms-with-more-than-six-joints).
All variables are offered, including those that a controller of the reported version would not have yet.
"""
REGISTER_ROWS = (
    ("{bank}_bit_registers0_to_31", Wire.UINT32, "bits 0–31"),
    ("{bank}_bit_registers32_to_63", Wire.UINT32, "bits 32–63"),
    ("{bank}_bit_register_64 … _127", Wire.BOOL, "one bit each"),
    ("{bank}_int_register_0 … _47", Wire.INT32, "integers"),
    ("{bank}_double_register_0 … _47", Wire.DOUBLE, "doubles"),
)


def page() -> str:
    """Return the page of reference that lists all variables."""
    outputs = _table(("variable", "type", "source", "what"), _outputs())
    inputs = _table(("variable", "type", "what"), _inputs())
    return f"""{HEAD}
## Outputs

{outputs}

## Inputs

A variable belongs to the first connection that asked for it until that connection is closed; for all others it is
`IN_USE`. The speed slider and the outputs are also `IN_USE` while another client has control. A value is passed on only
if it has changed.

{inputs}
"""


def describe(name: str) -> str:
    """Return what an output variable is; an empty text if there is none of this name."""
    return VARIABLES[name].what if name in VARIABLES else ""


def _outputs() -> Iterable[tuple[str, ...]]:
    for one in VARIABLES.values():
        yield f"`{one.name}`", one.type, one.source, one.what
    for bank in ("output", "input"):
        for name, wire, what in REGISTER_ROWS:
            yield f"`{name.format(bank=bank)}`", wire.name, "io", f"Registers: {what}."


def _inputs() -> Iterable[tuple[str, ...]]:
    for name, (wire, what) in NAMED_INPUTS.items():
        yield f"`{name}`", wire.name, what
    for name, wire, what in REGISTER_ROWS:
        yield f"`{name.format(bank='input')}`", wire.name, f"Registers: {what}."


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    print(page(), end="")  # noqa: T201  its purpose
