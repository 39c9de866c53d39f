"""Functions for digital and analogue inputs and outputs."""

from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import flag, integer, number, shown
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.moves import OWN_TOKEN
from tvist_protocol.io import SetIo
from tvist_urscript import Array, Fault, costs

STANDARD, CONFIGURABLE, TOOL = range(8), range(8, 16), range(16, 18)
"""Bits of the digital terminals."""


class TerminalFunctions:
    """Reads and sets the terminals of one robot.

    Args:
        access: The robot.
        arm: Its arm: what is set after a move that is blended is set where the blend begins.
    """

    def __init__(self, access: Access, arm: ProgramArm) -> None:
        self._terminals, self._arm = access.peripherals, arm

    # ------------------------------------------------------------------ digital

    @costs(10)
    def set_digital_out(self, n: object, b: object) -> None:
        """Set a digital output: 0 to 7 standard, 8 and 9 those of the tool, as before configurable ones existed."""
        number_ = integer("n", n, 0, 9)
        self._set(number_ if number_ < len(STANDARD) else TOOL[number_ - 8], flag("b", b))

    @costs(10)
    def set_standard_digital_out(self, n: object, b: object) -> None:
        """Set one of the eight standard digital outputs."""
        self._set(STANDARD[integer("n", n, 0, 7)], flag("b", b))

    @costs(10)
    def set_configurable_digital_out(self, n: object, b: object) -> None:
        """Set one of the eight configurable digital outputs."""
        self._set(CONFIGURABLE[integer("n", n, 0, 7)], flag("b", b))

    @costs(10)
    def set_tool_digital_out(self, n: object, b: object) -> None:
        """Set one of the two digital outputs of the tool."""
        self._set(TOOL[integer("n", n, 0, 1)], flag("b", b))

    def get_digital_in(self, n: object) -> bool:
        """Return a digital input, numbered as in `set_digital_out`."""
        number_ = integer("n", n, 0, 9)
        return self._input(number_ if number_ < len(STANDARD) else TOOL[number_ - 8])

    def get_digital_out(self, n: object) -> bool:
        """Return a digital output, numbered as in `set_digital_out`."""
        number_ = integer("n", n, 0, 9)
        return self._output(number_ if number_ < len(STANDARD) else TOOL[number_ - 8])

    def get_standard_digital_in(self, n: object) -> bool:
        """Return one of the eight standard digital inputs."""
        return self._input(STANDARD[integer("n", n, 0, 7)])

    def get_standard_digital_out(self, n: object) -> bool:
        """Return one of the eight standard digital outputs."""
        return self._output(STANDARD[integer("n", n, 0, 7)])

    def get_configurable_digital_in(self, n: object) -> bool:
        """Return one of the eight configurable digital inputs."""
        return self._input(CONFIGURABLE[integer("n", n, 0, 7)])

    def get_configurable_digital_out(self, n: object) -> bool:
        """Return one of the eight configurable digital outputs."""
        return self._output(CONFIGURABLE[integer("n", n, 0, 7)])

    def get_tool_digital_in(self, n: object) -> bool:
        """Return one of the two digital inputs of the tool."""
        return self._input(TOOL[integer("n", n, 0, 1)])

    def get_tool_digital_out(self, n: object) -> bool:
        """Return one of the two digital outputs of the tool."""
        return self._output(TOOL[integer("n", n, 0, 1)])

    # ------------------------------------------------------------------ analogue, tool and run state

    @costs(10)
    def set_analog_out(self, n: object, f: object) -> None:
        """Set an analogue output to a share of its range."""
        self.set_standard_analog_out(n, f)

    @costs(10)
    def set_standard_analog_out(self, n: object, f: object) -> None:
        """Set an analogue output to a share of its range."""
        place, share = integer("n", n, 0, 1), number("f", f, 0.0, 1.0)
        voltage = self._terminals.output_is_voltage(place)
        command = SetIo(
            token=OWN_TOKEN,
            standard_analog_output_mask=1 << place,
            standard_analog_output_type=int(voltage) << place,
            standard_analog_output_0=share,
            standard_analog_output_1=share,
        )
        self._arm.then(lambda: self._terminals.set_outputs(command))

    def set_analog_outputdomain(self, port: object, domain: object) -> None:
        """Make an analogue output a current (0) or a voltage (1)."""
        place, voltage = integer("port", port, 0, 1), bool(integer("domain", domain, 0, 1))
        self._arm.then(lambda: self._terminals.choose_output(place, voltage=voltage))

    def set_analog_inputrange(self, port: object, range: object) -> None:
        """Make ports 0 and 1 a voltage by ranges 0 and 2; those of the tool, 2 and 3, by 0 and 1, or a current by 2."""
        place = integer("port", port, 0, 3)
        which = integer("range", range, 0, 2)
        if place > 1:
            self._arm.then(lambda: self._terminals.choose_tool_input(place - 2, voltage=which < 2))
        elif which == 1:
            raise Fault("range is 1: a range from -5 to 5 V exists no more, so it must be 0 or 2")
        else:
            self._arm.then(lambda: self._terminals.choose_input(place, voltage=True))

    def set_standard_analog_input_domain(self, port: object, domain: object) -> None:
        """Make an analogue input a current (0) or a voltage (1)."""
        place, voltage = integer("port", port, 0, 1), bool(integer("domain", domain, 0, 1))
        self._arm.then(lambda: self._terminals.choose_input(place, voltage=voltage))

    def set_tool_voltage(self, voltage: object) -> None:
        """Set the supply of the tool: 0, 12 or 24 V."""
        wanted = integer("voltage", voltage, 0, 24)
        if wanted not in {0, 12, 24}:
            raise Fault(f"voltage is {wanted}: it must be 0, 12 or 24")
        self._arm.then(lambda: self._terminals.set_tool_voltage(wanted))

    def set_runstate_outputs(self, outputs: object) -> None:
        """Accept that no output shows whether a program runs.

        Raises:
            Fault: One should, which is not simulated.
        """
        if not isinstance(outputs, Array):
            raise Fault(f"outputs is {shown(outputs)}: it must be a list")
        if any(bool(item) for item in outputs.items):
            raise Fault("set_runstate_outputs: outputs that show whether a program runs are not simulated")

    def get_analog_in(self, n: object) -> float:
        """Return an analogue input: 0 and 1 of the control box, 2 and 3 of the tool [A or V]."""
        place = integer("n", n, 0, 3)
        return self.get_standard_analog_in(place) if place < 2 else self.get_tool_analog_in(place - 2)

    def get_standard_analog_in(self, n: object) -> float:
        """Return an analogue input of the control box [A or V]."""
        return self._terminals.analog_inputs[integer("n", n, 0, 1)]

    def get_tool_analog_in(self, n: object) -> float:
        """Return an analogue input of the tool [V]."""
        return self._terminals.tool_analog_inputs[integer("n", n, 0, 1)]

    def get_analog_out(self, n: object) -> float:
        """Return an analogue output as a share of its range."""
        return self.get_standard_analog_out(n)

    def get_standard_analog_out(self, n: object) -> float:
        """Return an analogue output as a share of its range."""
        return self._terminals.analog_ratio(integer("n", n, 0, 1))

    def _set(self, bit: int, on: bool) -> None:
        command = SetIo(token=OWN_TOKEN, digital_output_mask=1 << bit, digital_outputs=int(on) << bit)
        self._arm.then(lambda: self._terminals.set_outputs(command))

    def _input(self, bit: int) -> bool:
        return bool(self._terminals.digital_inputs >> bit & 1)

    def _output(self, bit: int) -> bool:
        return bool(self._terminals.digital_outputs >> bit & 1)
