"""Terminals, registers and tool centre point of a robot, set by commands and published as `Io`."""

from collections.abc import Callable, Mapping
from typing import Any, get_args

from tvist_controller.refusal import invalid, missing
from tvist_protocol.io import (
    BITS,
    NUMBERS,
    Bank,
    Io,
    Register,
    Registers,
    SetIo,
    SetRegisters,
    SimulationSetInputs,
)
from tvist_protocol.values import Payload

CURRENT = (0.004, 0.020)  # range of an analogue terminal set to current [A]
VOLTAGE = (0.0, 10.0)  # range of an analogue terminal set to voltage [V]
MIN_INTEGER, MAX_INTEGER = -(2**31), 2**31 - 1  # range of an integer register
_EMPTY: dict[str, list[Any]] = {"bit": [0] * (BITS // 32), "int": [0] * NUMBERS, "double": [0.0] * NUMBERS}
"""Initial registers of each kind."""


def analog_share(value: float, *, voltage: bool) -> float:
    """Convert an analogue terminal's voltage or current to a fraction of the terminal's range [-]."""
    low, high = VOLTAGE if voltage else CURRENT
    return (value - low) / (high - low)


class Peripherals:
    """Everything connected to the control box except the arm; initially off or zero."""

    def __init__(self, on_tcp: Callable[[tuple[float, ...]], None]) -> None:
        self._on_tcp = on_tcp
        self.digital_inputs = self.digital_outputs = 0
        """Digital terminals: bits 0–7 standard, 8–15 configurable, 16–17 tool."""
        self.analog_inputs, self.tool_analog_inputs = [CURRENT[0], CURRENT[0]], [0.0, 0.0]
        """Analogue inputs of the control box and of the tool [A or V]."""
        self.analog_shares = [0.0, 0.0]  # analogue outputs as fractions of their ranges [-]
        self._analog_types = 0
        self._registers: dict[Bank, list[Any]] = {
            bank: list(_EMPTY[bank.partition("_")[2]]) for bank in get_args(Bank)
        }
        self._written: dict[tuple[Bank, int], int] = {}
        self._tool: dict[str, Any] = {
            "tool_output_voltage": 0, "tool_analog_input_types": 0b11, "tool_output_mode": 0,
            "tool_digital_output0_mode": 1, "tool_digital_output1_mode": 1,
        }  # fmt: skip
        """Settings of the tool, as fields of `Io`."""
        self.changed = True  # whether `io` has changed since it was last published; the publisher resets it
        self.wrench_zero: list[float] | None = None
        """Force and torque subtracted as zero [N, N m]: at the tool in the base frame, or of the flange sensor."""
        self.payload_change: tuple[Payload, int, int] | None = None
        """Payload from which a program changes to the declared one, duration in ticks, and last tick."""
        self.tcp_offset: tuple[float, ...] = (0.0,) * 6
        """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""

    def set_outputs(self, command: SetIo) -> None:
        """Set the outputs selected by the masks."""
        self.set_digital_outputs(command.digital_output_mask, command.digital_outputs)
        for number, ratio in enumerate((command.standard_analog_output_0, command.standard_analog_output_1)):
            if command.standard_analog_output_mask >> number & 1:
                self.set_analog_output(number, ratio)
                self.choose(2 + number, voltage=bool(command.standard_analog_output_type >> number & 1))

    def set_digital_outputs(self, mask: int, values: int) -> None:
        """Set the digital outputs selected by the mask."""
        self.digital_outputs, self.changed = self.digital_outputs & ~mask | values & mask, True

    def set_analog_output(self, number: int, share: float) -> None:
        """Set an analogue output to a fraction of its voltage or current range."""
        self.analog_shares[number], self.changed = share, True

    def set_digital_inputs(self, mask: int, values: int) -> None:
        """Set the digital inputs selected by the mask."""
        self.digital_inputs, self.changed = self.digital_inputs & ~mask | values & mask, True

    def set_inputs(self, command: SimulationSetInputs) -> None:
        """Set signals at inputs."""
        self.set_digital_inputs(command.digital_input_mask, command.digital_inputs)
        if command.standard_analog_input is not None:
            self.analog_inputs = list(command.standard_analog_input)
        if command.analog_input_types is not None:
            self._analog_types = self._analog_types & ~0b11 | command.analog_input_types
        if command.tool_analog_input is not None:
            self.tool_analog_inputs = list(command.tool_analog_input)

    def set_tcp(self, offset: tuple[float, ...]) -> None:
        """Set the tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
        self.tcp_offset, self.changed = offset, True
        self._on_tcp(offset)

    # ------------------------------------------------------------------ for programs

    def choose(self, terminal: int, *, voltage: bool) -> None:
        """Set analogue input (0, 1) or output (2, 3) to voltage or current; its stored number is kept."""
        self._analog_types = self._analog_types & ~(1 << terminal) | voltage << terminal
        self.changed = True

    def choose_tool_input(self, number: int, *, voltage: bool) -> None:
        """Make an analogue input of the tool a voltage or a current; its stored number is not converted."""
        types = self._tool["tool_analog_input_types"]
        self.set_tool(tool_analog_input_types=types & ~(1 << number) | voltage << number)

    def set_tool(self, **settings: int) -> None:
        """Change settings of the tool, as fields of `Io`."""
        self._tool.update(settings)
        self.changed = True

    def zero_wrench(self, wrench: list[float] | None) -> None:
        """Set the force and torque counted as zero, see `wrench_zero` [N, N m]."""
        self.wrench_zero, self.changed = wrench, True

    def read(self, bank: Bank, place: int) -> Register:
        """Return a register."""
        values = self._registers[bank]
        return bool(values[place // 32] >> place % 32 & 1) if bank.endswith("bit") else values[place]

    def write(self, bank: Bank, place: int, value: Register) -> None:
        """Write a register; place and value must be valid."""
        values = self._registers[bank]
        if bank.endswith("bit"):
            place, mask = place // 32, 1 << place % 32
            value = values[place] | mask if value else values[place] & ~mask
        else:
            value = int(value) if bank.endswith("int") else float(value)
        self.changed |= values[place] != value
        values[place] = value

    def written(self, bank: Bank, place: int) -> int:
        """Return the tick after a client's last write to a register; 0 if no client has written to it."""
        return self._written.get((bank, place), 0)

    # ------------------------------------------------------------------ for clients

    def write_registers(self, command: SetRegisters, tick: int) -> None:
        """Write all registers of a client's command, or refuse them all; output registers need control."""
        runs: tuple[SetRegisters | Registers, ...] = (command, *command.also)
        for run in runs:
            if command.token is None and run.bank.startswith("output"):
                why = f"{run.bank} registers belong to the robot, and writing them needs control"
                raise missing("token", why)
        for number, run in enumerate(runs):
            where = f"also[{number - 1}].values" if number else "values"
            there = BITS if run.bank.endswith("bit") else NUMBERS
            if run.first + len(run.values) > there:
                count = f"{len(run.values)} values from register {run.first}"
                raise invalid(where, count, f"within the {there} registers of {run.bank}", there)
            for k, value in enumerate(run.values):
                _check(f"{where}[{k}]", value, run.bank)
        for run in runs:
            for place, value in enumerate(run.values, run.first):
                self.write(run.bank, place, value)
                self._written[run.bank, place] = tick

    def io(
        self,
        tick: int,
        payload: Payload,
        speed: float,
        program: Mapping[str, Any],
        wrench: list[float] | None,
        assumed: Payload | None = None,
    ) -> Io:
        """Return the message that publishes all this."""
        registers: dict[str, Any] = {
            f"{bank}_register": list(values) for bank, values in self._registers.items()
        }
        return Io(
            tick=tick,
            actual_digital_input_bits=self.digital_inputs,
            actual_digital_output_bits=self.digital_outputs,
            standard_analog_input=list(self.analog_inputs),
            standard_analog_output=[self._analog_output(number) for number in range(2)],
            analog_io_types=self._analog_types,
            tool_analog_input=list(self.tool_analog_inputs),
            **registers,
            tcp_offset=list(self.tcp_offset),
            payload=self._payload_at(tick, payload),
            target_speed_fraction=speed,
            **program,
            **self._tool,
            tcp_force_zero=self.wrench_zero,
            assumed_payload=assumed,
            actual_TCP_force=wrench,
        )

    def _payload_at(self, tick: int, after: Payload) -> Payload:
        """Return the payload at a tick; up to `after`, all properties change linearly, as on UR robots."""
        if self.payload_change is None:
            return after
        before, ticks, last = self.payload_change
        left, self.changed = max((last - tick) / ticks, 0.0), True
        if left == 0.0:
            self.payload_change = None
            return after
        old, new = ((one.mass, *one.com, *one.inertia) for one in (before, after))
        mass, x, y, z, xx, xy, xz, yy, yz, zz = (
            left * a + (1.0 - left) * b for a, b in zip(old, new, strict=True)
        )
        return Payload(mass=mass, com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))

    def _analog_output(self, number: int) -> float:
        low, high = VOLTAGE if self._analog_types >> (2 + number) & 1 else CURRENT
        return low + self.analog_shares[number] * (high - low)


def _check(where: str, value: Register, bank: Bank) -> None:
    """Refuse a value that its bank cannot hold."""
    if bank.endswith("bit"):
        fits, wanted = isinstance(value, bool), "true or false"
    elif bank.endswith("int"):
        fits = not isinstance(value, bool | float) and MIN_INTEGER <= value <= MAX_INTEGER
        wanted = f"an integer from {MIN_INTEGER} to {MAX_INTEGER}"
    else:
        fits, wanted = not isinstance(value, bool), "a number"
    if not fits:
        raise invalid(where, value, f"{wanted} for {bank} registers")
