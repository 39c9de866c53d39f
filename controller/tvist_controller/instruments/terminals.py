"""Inputs, outputs and registers, at the controller and in the tool."""

import re

from tvist_controller.instruments.reading import Reading
from tvist_controller.instruments.status import JOINT_IDLE, JOINT_MODES
from tvist_controller.instruments.variables import Double, Int32, Uint8, Uint32, Uint64
from tvist_protocol.io import BITS, NUMBERS

CONFIGURABLE = 0xFF00
"""Bits 8–15, the configurable terminals."""

_WORDS = re.compile(r"(input|output)_bit_registers(0_to_31|32_to_63)")
_REGISTER = re.compile(r"(input|output)_(bit|int|double)_register_(0|[1-9]\d{0,2})")


class TerminalValues(Reading):
    """Values of terminals and registers.

    Registers are attributes too: `input_int_register_7`, `output_bit_register_64`, `output_bit_registers0_to_31`.
    """

    @property
    def actual_digital_input_bits(self) -> Uint64:
        """Io: digital inputs; bits 0–7 standard, 8–15 configurable, 16–17 tool."""
        return self.io.actual_digital_input_bits

    @property
    def actual_digital_output_bits(self) -> Uint64:
        """Io: digital outputs, with the same bits."""
        return self.io.actual_digital_output_bits

    @property
    def actual_configurable_digital_input_bits(self) -> Uint64:
        """Io: bits 8–15 of the digital inputs, not shifted."""
        return self.io.actual_digital_input_bits & CONFIGURABLE

    @property
    def actual_configurable_digital_output_bits(self) -> Uint64:
        """Io: bits 8–15 of the digital outputs, not shifted."""
        return self.io.actual_digital_output_bits & CONFIGURABLE

    @property
    def analog_io_types(self) -> Uint32:
        """Io: bits 0–1 analogue inputs, 2–3 outputs; 0 is current, 1 voltage."""
        return self.io.analog_io_types

    @property
    def standard_analog_input0(self) -> Double:
        """Io: analogue input 0 [A or V]."""
        return self.io.standard_analog_input[0]

    @property
    def standard_analog_input1(self) -> Double:
        """Io: analogue input 1 [A or V]."""
        return self.io.standard_analog_input[1]

    @property
    def standard_analog_output0(self) -> Double:
        """Io: analogue output 0 [A or V]."""
        return self.io.standard_analog_output[0]

    @property
    def standard_analog_output1(self) -> Double:
        """Io: analogue output 1 [A or V]."""
        return self.io.standard_analog_output[1]

    @property
    def io_current(self) -> Double:
        """Constant: 0; nothing draws current from the terminals [mA]."""
        return 0.0

    @property
    def tool_mode(self) -> Uint32:
        """Computed: from the robot's mode, with the numbers of `joint_mode`."""
        return JOINT_MODES.get(self.state.robot_mode, JOINT_IDLE)

    @property
    def tool_analog_input_types(self) -> Uint32:
        """Io: types of the tool's analogue inputs, bits 0–1; 0 is current, 1 voltage."""
        return self.io.tool_analog_input_types

    @property
    def tool_analog_input0(self) -> Double:
        """Io: analogue input 0 of the tool [A or V]."""
        return self.io.tool_analog_input[0]

    @property
    def tool_analog_input1(self) -> Double:
        """Io: analogue input 1 of the tool [A or V]."""
        return self.io.tool_analog_input[1]

    @property
    def tool_output_voltage(self) -> Int32:
        """Io: voltage of the tool's supply; 0 if it is off [V]."""
        return self.io.tool_output_voltage

    @property
    def tool_output_current(self) -> Double:
        """Constant: 0; nothing draws current from it [mA]."""
        return 0.0

    @property
    def tool_temperature(self) -> Double:
        """Computed: temperature of the last joint, which holds the tool's electronics [°C]."""
        return self._temperatures[-1]

    @property
    def tool_output_mode(self) -> Uint8:
        """Io: 0, the tool's outputs are digital ones; 1, they are a second supply."""
        return self.io.tool_output_mode

    @property
    def tool_digital_output0_mode(self) -> Uint8:
        """Io: 1, the output sinks; 2, it sources; 3, both."""
        return self.io.tool_digital_output0_mode

    @property
    def tool_digital_output1_mode(self) -> Uint8:
        """Io: 1, the output sinks; 2, it sources; 3, both."""
        return self.io.tool_digital_output1_mode

    @property
    def euromap67_input_bits(self) -> Uint32:
        """Constant: 0; no Euromap 67 interface is fitted."""
        return 0

    @property
    def euromap67_output_bits(self) -> Uint32:
        """Constant: 0; no Euromap 67 interface is fitted."""
        return 0

    @property
    def euromap67_24V_voltage(self) -> Double:
        """Constant: 0; no Euromap 67 interface is fitted [V]."""
        return 0.0

    @property
    def euromap67_24V_current(self) -> Double:
        """Constant: 0; no Euromap 67 interface is fitted [mA]."""
        return 0.0

    @property
    def encoder0_raw(self) -> Int32:
        """Constant: 0; no conveyor's encoder is connected."""
        return 0

    @property
    def encoder1_raw(self) -> Int32:
        """Constant: 0; no conveyor's encoder is connected."""
        return 0

    def __getattr__(self, name: str) -> bool | int | float:
        return self.register(name)

    def register(self, name: str) -> bool | int | float:
        """Return a register by RTDE's name.

        Raises:
            AttributeError: There is none of this name.
        """
        found = _WORDS.fullmatch(name)
        if found is not None:
            words: list[int] = getattr(self.io, f"{found[1]}_bit_register")
            return words[found[2] == "32_to_63"]
        found = _REGISTER.fullmatch(name)
        if found is None or int(found[3]) >= (BITS if found[2] == "bit" else NUMBERS):
            raise AttributeError(f"{type(self).__name__} has no {name}")
        number, values = int(found[3]), getattr(self.io, f"{found[1]}_{found[2]}_register")
        if found[2] == "bit":
            return bool(values[number // 32] >> number % 32 & 1)
        value: int | float = values[number]
        return value
