"""State of terminals and registers, and the commands that change it; names and bit order are those of RTDE."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_protocol.client_message import ClientMessage, Leased
from tvist_protocol.programs import Interpreter, ProgramLabel, ProgramState
from tvist_protocol.values import Fraction, Payload, Token

BITS, NUMBERS = 128, 48  # number of registers in a bank of bits, and in a bank of integers or doubles
Bank = Literal["input_bit", "input_int", "input_double", "output_bit", "output_int", "output_double"]
"""Banks of registers: clients write input registers, which programs read; programs write output registers."""


class Io(Struct, frozen=True, kw_only=True, tag_field="type", tag="io"):
    """Inputs, outputs and registers from the following tick on, and the settings of the tool."""

    tick: int
    """First control period for which these values hold."""
    actual_digital_input_bits: int
    """Digital inputs: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    actual_digital_output_bits: int
    """Digital outputs: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    standard_analog_input: list[float]
    """Two analogue inputs [A or V, by `analog_io_types`]."""
    standard_analog_output: list[float]
    """Two analogue outputs [A or V, by `analog_io_types`]."""
    analog_io_types: int
    """Types of the analogue inputs (bits 0–1) and outputs (bits 2–3): 0 is current (4–20 mA), 1 voltage (0–10 V)."""
    tool_analog_input: list[float]
    """Two analogue inputs of the tool [A or V, by `tool_analog_input_types`]."""
    input_bit_register: list[int]
    """128 input bits as four words of 32, the lowest first."""
    input_int_register: list[int]
    """48 input integers."""
    input_double_register: list[float]
    """48 input doubles."""
    output_bit_register: list[int]
    """128 output bits as four words of 32, the lowest first."""
    output_int_register: list[int]
    """48 output integers."""
    output_double_register: list[float]
    """48 output doubles."""
    tcp_offset: list[float]
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
    payload: Payload
    """Declared payload."""
    target_speed_fraction: float
    """Position of the speed slider [-]."""
    program: str | None = None
    """Loaded program; null if there is none."""
    program_state: ProgramState = "STOPPED"
    """State of the loaded program."""
    program_line: int = 0
    """Line that is being executed, or will be when the program continues, counted from 1; 0 if there is none."""
    program_label: ProgramLabel | None = None
    """Label that the program has passed last; null if there is none."""
    interpreter: Interpreter | None = None
    """Statements that clients have added to the program; null before the first program that accepts some."""
    watched: list[str] = []
    """RTDE names of input registers whose writes the program counts, even writes of the same value."""
    tool_output_voltage: int = 0
    """Supply voltage of the tool [V]."""
    tool_analog_input_types: int = 3
    """Types of the tool's analogue inputs, bit 0 for the first: 0 is current (4–20 mA), 1 voltage (0–10 V)."""
    tool_output_mode: int = 0
    """Use of the tool's digital outputs: 0 as outputs, 1 as a second supply."""
    tool_digital_output0_mode: int = 1
    """What the first digital output of the tool does: 1 sinks, 2 sources, 3 both."""
    tool_digital_output1_mode: int = 1
    """What the second digital output of the tool does."""
    tcp_force_zero: list[float] | None = None
    """Force and torque that count as zero: of a sensor in its frame, else at the tool in the base frame [N, N m]."""
    assumed_payload: Payload | None = None
    """Payload that the robot has identified and uses instead of the declared one; null: the declared one is used."""
    actual_TCP_force: list[float] | None = None
    """Force and torque at the tool centre point that explain the torques measured in the previous tick, in the base
    frame [N, N m]; zero while the arm is braked. Sent once a second; null in messages sent because of a change."""


DigitalBits = Annotated[int, Meta(ge=0, le=2**18 - 1)]  # bits 0–7 standard, 8–15 configurable, 16–17 tool
PairBits = Annotated[int, Meta(ge=0, le=3)]  # one bit for each of two terminals
Signal = Annotated[float, Meta(ge=-1, le=30)]  # [A or V]
Register = (
    bool | Annotated[int, Meta(ge=-(2**31), le=2**32 - 1)] | Annotated[float, Meta(ge=-1e308, le=1e308)]
)
"""A bit, a 32-bit integer or a double"""
Length = Annotated[float, Meta(ge=-10, le=10)]  # [m]
Turn = Annotated[float, Meta(ge=-10, le=10)]  # [rad]


class SetIo(Leased, frozen=True, kw_only=True, tag="set_io"):
    """Set the outputs that a mask selects."""

    digital_output_mask: DigitalBits = 0
    """Digital outputs to set: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    digital_outputs: DigitalBits = 0
    """Values of the digital outputs, with the same bits."""
    standard_analog_output_mask: PairBits = 0
    """Analogue outputs to set, bit 0 for the first."""
    standard_analog_output_type: PairBits = 0
    """Types of the analogue outputs, bit 0 for the first: 0 is current (4–20 mA), 1 voltage (0–10 V)."""
    standard_analog_output_0: Fraction = 0.0
    """Value of the first analogue output as a share of its range [-]."""
    standard_analog_output_1: Fraction = 0.0
    """Value of the second analogue output as a share of its range [-]."""


class Registers(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Consecutive registers that a `set_registers` writes in addition to others."""

    bank: Bank
    """Bank of registers to write."""
    values: Annotated[tuple[Register, ...], Meta(min_length=1, max_length=BITS)]
    """Values to write, as in `set_registers`."""
    first: Annotated[int, Meta(ge=0, le=BITS - 1)] = 0
    """Number of the first register."""


class SetRegisters(ClientMessage, frozen=True, kw_only=True, tag="set_registers", omit_defaults=True):
    """Write registers at one tick: consecutive ones, and optionally others."""

    bank: Bank
    """Bank of registers to write."""
    values: Annotated[tuple[Register, ...], Meta(min_length=1, max_length=BITS)]
    """Values to write: booleans, 32-bit integers or doubles, depending on the bank."""
    first: Annotated[int, Meta(ge=0, le=BITS - 1)] = 0
    """Number of the first register."""
    token: Token | None = None
    """Token of the lease; output registers, which belong to the robot, need it, input registers do not."""
    also: Annotated[tuple[Registers, ...], Meta(max_length=BITS)] = ()
    """Further registers; programs never see only some of them written."""


class SetTcp(Leased, frozen=True, kw_only=True, tag="set_tcp"):
    """Set the tool centre point."""

    offset: Annotated[tuple[Length, Length, Length, Turn, Turn, Turn], "x y z rx ry rz"]
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""


class SimulationSetInputs(Leased, frozen=True, kw_only=True, tag="simulation.set_inputs"):
    """Simulate signals at the inputs."""

    digital_input_mask: DigitalBits = 0
    """Digital inputs to set: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
    digital_inputs: DigitalBits = 0
    """Values of the digital inputs, with the same bits."""
    standard_analog_input: tuple[Signal, Signal] | None = None
    """Values of both analogue inputs [A or V, by `analog_input_types`]; null leaves them unchanged."""
    analog_input_types: PairBits | None = None
    """Types of the analogue inputs, bit 0 for the first: 0 is current, 1 voltage; null leaves them unchanged."""
    tool_analog_input: tuple[Signal, Signal] | None = None
    """Values of both analogue inputs of the tool [V]; null leaves them unchanged."""
