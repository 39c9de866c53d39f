"""What stands on a robot's terminals and in its registers, and the commands that change it.

Names, and the order of bits, are RTDE's.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_protocol.client_message import ClientMessage
from tvist_protocol.programs import ProgramState
from tvist_protocol.values import Fraction, Payload, Token

BITS, NUMBERS = 128, 48
"""Registers of a bank: of bits, and of either kind of number."""
Bank = Literal["input_bit", "input_int", "input_double", "output_bit", "output_int", "output_double"]
"""Registers are memory: input registers are written by clients and read by the robot's programs, output registers
the other way round."""


class Io(Struct, frozen=True, kw_only=True, tag_field="type", tag="io"):
    """Inputs, outputs and registers of the tick that follows it, and what the robot is told about its tool."""

    tick: int
    """First control period for which this holds."""
    actual_digital_input_bits: int
    """Digital inputs: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    actual_digital_output_bits: int
    """Digital outputs, likewise."""
    standard_analog_input: list[float]
    """Two analogue inputs [A or V, as `analog_io_types`]."""
    standard_analog_output: list[float]
    """Two analogue outputs [A or V, as `analog_io_types`]."""
    analog_io_types: int
    """Bits 0–1 inputs, 2–3 outputs: 0 is current (4–20 mA), 1 voltage (0–10 V)."""
    tool_analog_input: list[float]
    """Two analogue inputs of the tool [V]."""
    input_bit_register: list[int]
    """128 bits as four words of 32, the lowest first."""
    input_int_register: list[int]
    """48 of them."""
    input_double_register: list[float]
    """48 of them."""
    output_bit_register: list[int]
    """128 bits as four words of 32, the lowest first."""
    output_int_register: list[int]
    """48 of them."""
    output_double_register: list[float]
    """48 of them."""
    tcp_offset: list[float]
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
    payload: Payload
    """Declared: what the controller believes."""
    target_speed_fraction: float
    """The speed slider [-]."""
    program: str | None = None
    """The program that is loaded; null: none."""
    program_state: ProgramState = "STOPPED"
    """What it does."""
    program_line: int = 0
    """Its line that is carried out, or comes next when it is played on, counted from 1; 0: none."""
    actual_TCP_force: list[float] | None = None
    """Force and torque at the tool centre point that explain the torques measured in the tick before, base frame
    [N, N m]; zero while the arm is braked. Told once a second; null where `io` is told since something changed."""


DigitalBits = Annotated[int, Meta(ge=0, le=2**18 - 1)]
"""Bits 0–7 standard, 8–15 configurable, 16–17 tool"""
PairBits = Annotated[int, Meta(ge=0, le=3)]
"""A bit for each of two terminals"""
Signal = Annotated[float, Meta(ge=-1, le=30)]
"""[A or V]"""
Register = (
    bool | Annotated[int, Meta(ge=-(2**31), le=2**32 - 1)] | Annotated[float, Meta(ge=-1e308, le=1e308)]
)
"""A bit, a 32-bit integer or a double"""
Length = Annotated[float, Meta(ge=-10, le=10)]
"""[m]"""
Turn = Annotated[float, Meta(ge=-10, le=10)]
"""[rad]"""


class SetIo(ClientMessage, frozen=True, kw_only=True, tag="set_io"):
    """Set outputs: those that a mask names."""

    token: Token
    """Names the lease."""
    digital_output_mask: DigitalBits = 0
    """Digital outputs to set: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    digital_outputs: DigitalBits = 0
    """What to set them to, likewise."""
    standard_analog_output_mask: PairBits = 0
    """Analogue outputs to set, bit 0 the first."""
    standard_analog_output_type: PairBits = 0
    """What each is, bit 0 the first: 0 is current (4–20 mA), 1 voltage (0–10 V)."""
    standard_analog_output_0: Fraction = 0.0
    """Share of the first one's range [-]."""
    standard_analog_output_1: Fraction = 0.0
    """Share of the second one's range [-]."""


class SetRegisters(ClientMessage, frozen=True, kw_only=True, tag="set_registers"):
    """Write registers that stand in a row."""

    bank: Bank
    """Which."""
    values: Annotated[tuple[Register, ...], Meta(min_length=1, max_length=BITS)]
    """What to write: booleans, integers of 32 bits or doubles, as the bank has them."""
    first: Annotated[int, Meta(ge=0, le=BITS - 1)] = 0
    """Number of the first register."""
    token: Token | None = None
    """Names the lease; output registers, which are the robot's own, need it, input registers do not."""


class SetTcp(ClientMessage, frozen=True, kw_only=True, tag="set_tcp"):
    """Say where the tool centre point is."""

    token: Token
    """Names the lease."""
    offset: tuple[Length, Length, Length, Turn, Turn, Turn]
    """In the flange frame: x y z [m] and rotation vector [rad]."""


class SimulationSetInputs(ClientMessage, frozen=True, kw_only=True, tag="simulation.set_inputs"):
    """Put signals on the inputs, as what is wired to them would."""

    token: Token
    """Names the lease."""
    digital_input_mask: DigitalBits = 0
    """Digital inputs to set: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    digital_inputs: DigitalBits = 0
    """What to set them to, likewise."""
    standard_analog_input: tuple[Signal, Signal] | None = None
    """Both analogue inputs [A or V, as `analog_input_types`]; null leaves them."""
    analog_input_types: PairBits | None = None
    """What each is, bit 0 the first: 0 is current, 1 voltage; null leaves them."""
    tool_analog_input: tuple[Signal, Signal] | None = None
    """Both analogue inputs of the tool [V]; null leaves them."""
