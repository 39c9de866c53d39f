"""Functions for digital and analogue terminals, registers and flags."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Literal

from tvist_controller.instruments.peripherals import MAX_INTEGER, MIN_INTEGER
from tvist_controller.programs.arguments import Bit, Flag, Number, Share, either, integer, shown, whole
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup, described
from tvist_protocol.io import BITS, NUMBERS, Bank
from tvist_urscript import Array, Fault, costs

STANDARD, CONFIGURABLE, TOOL = range(8), range(8, 16), range(16, 18)  # bits of the digital terminals
FLAGS = 32  # number of flags; only programs have them


def _old(name: str, value: object) -> int:
    """Return the bit of a digital terminal in the old numbering without configurable ones."""
    number = integer(name, value, 0, 9)
    return number if number < len(STANDARD) else TOOL[number - 8]


Old = Annotated[int, _old]
Standard = Annotated[int, lambda name, value: STANDARD[whole(0, 7)(name, value)]]
Configurable = Annotated[int, lambda name, value: CONFIGURABLE[whole(0, 7)(name, value)]]
Tool = Annotated[int, lambda name, value: TOOL[whole(0, 1)(name, value)]]
AnalogPort = Annotated[int, whole(0, 3)]
Voltage = Annotated[bool, either]
BitPlace = Annotated[int, whole(0, BITS - 1)]
NumberPlace = Annotated[int, whole(0, NUMBERS - 1)]
FlagPlace = Annotated[int, whole(0, FLAGS - 1)]


def _register(what: str, place: object, bank: Bank) -> Callable[[FunctionGroup, int], bool | float]:
    def get(self: FunctionGroup, address: int) -> bool | float:
        return self._peripherals.read(bank, address)

    return described(get, what, address=place)


def _terminal(
    bits: Literal["digital_inputs", "digital_outputs"], what: str, place: object
) -> Callable[[FunctionGroup, int], bool]:
    def get(self: FunctionGroup, n: int) -> bool:
        return bool(getattr(self._peripherals, bits) >> n & 1)

    return described(get, what, n=place)


_input, _output = partial(_terminal, "digital_inputs"), partial(_terminal, "digital_outputs")


def _sets(what: str, place: object) -> Callable[[FunctionGroup, int, Flag], None]:
    @costs(10)
    def set_one(self: FunctionGroup, n: int, b: Flag) -> None:
        self._arm.then(lambda: self._peripherals.set_digital_outputs(1 << n, b << n))

    return described(set_one, what, n=place)


class RegisterFunctions(FunctionGroup):
    """Registers and flags of one robot."""

    title = "Registers and flags"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._flags = [False] * FLAGS

    read_input_boolean_register = _register("Read an input bit, which clients write.", BitPlace, "input_bit")
    read_input_integer_register = _register(
        "Read an input integer, which clients write.", NumberPlace, "input_int"
    )
    read_input_float_register = _register(
        "Read an input number, which clients write.", NumberPlace, "input_double"
    )
    read_output_boolean_register = _register(
        "Read an output bit, which programs write.", BitPlace, "output_bit"
    )
    read_output_integer_register = _register(
        "Read an output integer, which programs write.", NumberPlace, "output_int"
    )
    read_output_float_register = _register(
        "Read an output number, which programs write.", NumberPlace, "output_double"
    )

    @costs(8)
    def write_output_boolean_register(self, address: BitPlace, value: Flag) -> None:
        """Write an output bit for clients."""
        self._arm.then(lambda: self._peripherals.write("output_bit", address, value))

    @costs(8)
    def write_output_integer_register(
        self, address: NumberPlace, value: Annotated[int, whole(MIN_INTEGER, MAX_INTEGER)]
    ) -> None:
        """Write a 32-bit output integer for clients."""
        self._arm.then(lambda: self._peripherals.write("output_int", address, value))

    @costs(8)
    def write_output_float_register(self, address: NumberPlace, value: Number) -> None:
        """Write an output number for clients."""
        self._arm.then(lambda: self._peripherals.write("output_double", address, value))

    def get_flag(self, n: FlagPlace) -> bool:
        """Return one of 32 flags, which only programs can read and set."""
        return self._flags[n]

    @costs(3)
    def set_flag(self, n: FlagPlace, value: Flag) -> None:
        """Set one of the flags."""

        def write() -> None:
            self._flags[n] = value

        self._arm.then(write)


class TerminalFunctions(FunctionGroup):
    """Terminals of one robot."""

    title = "Inputs and outputs"

    # ------------------------------------------------------------------ digital

    set_digital_out = _sets(
        "Set a digital output: 0 to 7 standard, 8 and 9 of the tool; cannot set configurable ones.", Old
    )
    set_standard_digital_out = _sets("Set one of the eight standard digital outputs.", Standard)
    set_configurable_digital_out = _sets("Set one of the eight configurable digital outputs.", Configurable)
    set_tool_digital_out = _sets("Set one of the two digital outputs of the tool.", Tool)
    get_digital_in = _input("Return a digital input, numbered as in `set_digital_out`.", Old)
    get_digital_out = _output("Return a digital output, numbered as in `set_digital_out`.", Old)
    get_standard_digital_in = _input("Return one of the eight standard digital inputs.", Standard)
    get_standard_digital_out = _output("Return one of the eight standard digital outputs.", Standard)
    get_configurable_digital_in = _input("Return one of the eight configurable digital inputs.", Configurable)
    get_configurable_digital_out = _output(
        "Return one of the eight configurable digital outputs.", Configurable
    )
    get_tool_digital_in = _input("Return one of the two digital inputs of the tool.", Tool)
    get_tool_digital_out = _output("Return one of the two digital outputs of the tool.", Tool)

    # ------------------------------------------------------------------ analogue, tool and run state

    @costs(10)
    def set_analog_out(self, n: Bit, f: Share) -> None:
        """Set an analogue output to a fraction of its range."""
        self._arm.then(lambda: self._peripherals.set_analog_output(n, f))

    set_standard_analog_out = set_analog_out

    def set_analog_outputdomain(self, port: Bit, domain: Voltage) -> None:
        """Make an analogue output a current (0) or a voltage (1)."""
        self._arm.then(lambda: self._peripherals.choose(2 + port, voltage=domain))

    def set_analog_inputrange(self, port: AnalogPort, range: Annotated[int, whole(0, 2)]) -> None:
        """Make port 0 or 1 a voltage (range 0 or 2), tool port 2 or 3 a voltage (0, 1) or current (2)."""
        if port > 1:
            self._arm.then(lambda: self._peripherals.choose_tool_input(port - 2, voltage=range < 2))
        elif range == 1:
            raise Fault("range is 1: a range from -5 to 5 V exists no more, so it must be 0 or 2")
        else:
            self._arm.then(lambda: self._peripherals.choose(port, voltage=True))

    def set_standard_analog_input_domain(self, port: Bit, domain: Voltage) -> None:
        """Make an analogue input a current (0) or a voltage (1)."""
        self._arm.then(lambda: self._peripherals.choose(port, voltage=domain))

    def set_tool_voltage(self, voltage: Annotated[int, whole(0, 24)]) -> None:
        """Set the supply of the tool: 0, 12 or 24 V."""
        if voltage not in {0, 12, 24}:
            raise Fault(f"voltage is {voltage}: it must be 0, 12 or 24")
        self._arm.then(lambda: self._peripherals.set_tool(tool_output_voltage=voltage))

    def set_runstate_outputs(self, outputs: object) -> None:
        """Fail if an output shall show whether a program runs."""
        if not isinstance(outputs, Array):
            raise Fault(f"outputs is {shown(outputs)}: it must be a list")
        if any(bool(item) for item in outputs.items):
            raise Fault(
                f"outputs is {shown(outputs)}: it must have no True; to show whether a program runs, call "
                "set_runstate_standard_digital_output_to_value instead"
            )

    def get_analog_in(self, n: AnalogPort) -> float:
        """Return an analogue input: 0 and 1 of the control box, 2 and 3 of the tool [A or V]."""
        return self.get_standard_analog_in(n) if n < 2 else self.get_tool_analog_in(n - 2)

    def get_standard_analog_in(self, n: Bit) -> float:
        """Return an analogue input of the control box [A or V]."""
        return self._peripherals.analog_inputs[n]

    def get_tool_analog_in(self, n: Bit) -> float:
        """Return an analogue input of the tool [V]."""
        return self._peripherals.tool_analog_inputs[n]

    def get_analog_out(self, n: Bit) -> float:
        """Return an analogue output as a fraction of its range."""
        return self._peripherals.analog_shares[n]

    get_standard_analog_out = get_analog_out
