"""`python -m tvist_server.gateways.ur.rtde.table`: prints docs/reference/generated/rtde-variables.md."""

from tvist_controller.instruments.variables import VARIABLES
from tvist_protocol.pages import markdown_table
from tvist_server.gateways.ur.rtde.variables import NAMED as NAMED_INPUTS
from tvist_server.rtde.wire import WireType

HEAD = """\
# RTDE variables

All variables of RTDE, and where their values come from. Printed by `python -m tvist_server.gateways.ur.rtde.table`.
An output has one of four sources:

- **state**: the value in [`state`](protocol.md#state) at the same tick, equal to the last bit;
- **io**: terminals, registers, payload and tool centre point;
- **computed**: computed from state and io, as the last column describes;
- **constant**: stands in for something that is not simulated.

No value was measured on a robot. Torque constants, resistances and thermal parameters of the motors are estimates for
the two joint sizes of a UR5e (10 and 7.9 N m/A on the joint's side). Temperatures and energies are integrated from the
first tick on, even if no client reads them.

Joint vectors have six entries. An arm with fewer joints fills the rest with zeros; an arm with more
[has no RTDE](../../how-to/connect-ur-clients.md#arms-with-more-than-six-joints). All variables are offered, including
those that software of the reported version does not have yet.
"""
REGISTER_ROWS = (
    ("{bank}_bit_registers0_to_31", WireType.UINT32, "bits 0–31"),
    ("{bank}_bit_registers32_to_63", WireType.UINT32, "bits 32–63"),
    ("{bank}_bit_register_64 … _127", WireType.BOOL, "one bit each"),
    ("{bank}_int_register_0 … _47", WireType.INT32, "integers"),
    ("{bank}_double_register_0 … _47", WireType.DOUBLE, "doubles"),
)


def page() -> str:
    """Return the reference page that lists all variables."""
    registers = {
        side: [
            (f"`{name.format(bank=side)}`", wire.name, f"Registers: {what}.")
            for name, wire, what in REGISTER_ROWS
        ]
        for side in ("output", "input")
    }
    named = [(f"`{one.name}`", one.type, one.source, one.what) for one in VARIABLES.values()]
    numbered = [(name, wire, "io", what) for side in registers.values() for name, wire, what in side]
    outputs = markdown_table(("variable", "type", "source", "what"), [*named, *numbered])
    given = [(f"`{name}`", wire.name, what) for name, (wire, what) in NAMED_INPUTS.items()]
    inputs = markdown_table(("variable", "type", "what"), [*given, *registers["input"]])
    return f"""{HEAD}
## Outputs

{outputs}

## Inputs

A variable belongs to the first connection that requests it, until that connection is closed; all others get `IN_USE`.
The speed slider and the outputs are also `IN_USE` while another client has control. A value takes effect only if it has
changed.

{inputs}
"""


def describe(name: str) -> str:
    """Return the description of an output variable; empty if there is none of this name."""
    return VARIABLES[name].what if name in VARIABLES else ""


if __name__ == "__main__":
    print(page(), end="")  # noqa: T201  its purpose
