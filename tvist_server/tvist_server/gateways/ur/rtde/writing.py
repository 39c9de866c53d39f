"""Turns the input variables of data packages into commands, omitting values that are already in force."""

from collections.abc import Awaitable, Callable, Hashable, Iterable, Iterator
from itertools import groupby
from math import isclose
from typing import Any

from tvist_controller.instruments.peripherals import analog_share
from tvist_protocol.commands import SetSpeed
from tvist_protocol.forces import SetExternalWrench
from tvist_protocol.io import Bank, Io, Registers, SetIo, SetRegisters
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.ur.deferred import begin
from tvist_server.gateways.ur.lease import ConnectionControl, MakeCommand
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.recipes import Value
from tvist_server.gateways.ur.rtde.variables import DIGITAL, REGISTERS
from tvist_server.rtde.wire import WireType

Number = bool | int | float
LARGEST = 1e308  # largest absolute value of an input; infinity and NaN are refused


class InputWriter:
    """Sets one connection's inputs. A missing input keeps its last value; a mask never sent counts as 0."""

    def __init__(self, robot: UrRobot, control: ConnectionControl, warn: Callable[[str], None]) -> None:
        self._robot = robot
        self._control = control
        self._warn = warn
        self._pending = robot.inputs.pending
        self._held: dict[str, Value] = {}

    def write(self, values: dict[str, Value]) -> None:
        """Set the variables of one package; values that are not finite are refused with a warning."""
        for name, value in values.items():
            numbers = value if isinstance(value, tuple) else (value,)
            if not all(abs(number) <= LARGEST for number in numbers):
                self._warn(f"{name} is {value}: must be a number within ±{LARGEST:g}")
                values = {other: kept for other, kept in values.items() if other != name}
        self._held |= values
        registers = {name: value for name, value in values.items() if name in REGISTERS}
        if registers:
            self._set_registers(registers)
        if len(registers) == len(values):
            return
        wrench = values.get("external_force_torque")
        io = self._io
        if (
            isinstance(wrench, tuple) and io is not None and io.program_state != "STOPPED"
        ):  # otherwise no program reads it
            a, b, c, d, e, f = (float(number) for number in wrench)
            self._change({}, lambda token: SetExternalWrench(token=token, wrench=(a, b, c, d, e, f)))
        if "speed_slider_mask" in values or "speed_slider_fraction" in values:
            self._set_speed()
        if any("_output" in name for name in values):
            self._set_outputs(values)

    @property
    def _io(self) -> Io | None:
        latest = self._robot.latest
        return None if latest is None else latest.io

    def _number(self, name: str) -> float:
        value = self._held.get(name, 0)
        assert not isinstance(value, tuple)
        return value

    def _set_registers(self, values: dict[str, Value]) -> None:
        io = self._io
        watched = () if io is None else io.watched  # the program's watchdogs count every write
        news: dict[Hashable, object] = {
            name: value
            for name, value in values.items()
            if name in watched
            or self._pending.changed(name, value, None if io is None else _present(io, name))
        }
        if not news:
            return
        cells: dict[Bank, dict[int, tuple[Number, bool]]] = {}
        for name, value in values.items():
            bank, first, wire = REGISTERS[name]
            assert not isinstance(value, tuple)
            new, cell = name in news, cells.setdefault(bank, {})
            if wire is WireType.UINT32:
                cell.update({first + k: (bool(int(value) >> k & 1), new) for k in range(32)})
            else:
                cell[first] = (value, new)
        # One command, because programs must see a package as a whole: if one register selects an action and
        # others hold its numbers, the action must not use the numbers of the previous package.
        head, *rest = [
            Registers(bank=bank, first=first, values=run)
            for bank, cell in cells.items()
            for first, run in _runs(cell)
        ]
        command = SetRegisters(bank=head.bank, first=head.first, values=head.values, also=tuple(rest))
        self._pending.ask(news)
        begin(self._answered(news, self._control.ask(command)))

    def _set_speed(self) -> None:
        fraction = self._number("speed_slider_fraction")
        if not int(self._number("speed_slider_mask")) & 1 or not self._is_share("speed_slider_fraction"):
            return
        io = self._io
        if self._pending.changed("speed", fraction, None if io is None else io.target_speed_fraction):
            self._change({"speed": fraction}, lambda token: SetSpeed(token=token, fraction=fraction))

    def _set_outputs(self, values: Iterable[str]) -> None:
        """Set the digital and analogue outputs that a package changes, in one command."""
        groups = {name.partition("_output")[0] for name in values}
        news = {
            output: value
            for output, value, present in self._outputs(groups)
            if self._pending.changed(output, value, present)
        }
        if not news:
            return
        digital = {bit: on for (kind, bit), on in news.items() if kind == "digital"}
        analog = {number: value for (kind, number), value in news.items() if kind == "analog"}
        shares = [analog[number][1] if number in analog else 0.0 for number in range(2)]
        self._change(
            dict(news),
            lambda token: SetIo(
                token=token,
                digital_output_mask=sum(1 << bit for bit in digital),
                digital_outputs=sum(1 << bit for bit, on in digital.items() if on),
                standard_analog_output_mask=sum(1 << number for number in analog),
                standard_analog_output_type=sum(voltage << number for number, (voltage, _) in analog.items()),
                standard_analog_output_0=shares[0],
                standard_analog_output_1=shares[1],
            ),
        )

    def _outputs(self, groups: set[str]) -> Iterator[tuple[tuple[str, int], Any, Any]]:
        """Yield each output that these groups' masks select: its kind and number, wanted and present value.

        The value of an analogue output is a pair: type, and share of the range.
        """
        io = self._io
        for group, (first, count) in DIGITAL.items():
            if f"{group}_digital" not in groups or f"{group}_digital_output" not in self._held:
                continue
            mask, wanted = (int(self._number(f"{group}_digital_output{part}")) for part in ("_mask", ""))
            for bit in range(count):
                if mask >> bit & 1:
                    on = None if io is None else bool(io.actual_digital_output_bits >> (first + bit) & 1)
                    yield ("digital", first + bit), bool(wanted >> bit & 1), on
        if "standard_analog" not in groups:
            return
        mask, types = (int(self._number(f"standard_analog_output_{part}")) for part in ("mask", "type"))
        for number in range(2):
            name, present = f"standard_analog_output_{number}", None
            if not mask >> number & 1 or not self._is_share(name):
                continue
            share = float(self._number(name))
            if io is not None:
                voltage = io.analog_io_types >> (2 + number) & 1
                # The robot publishes volts or amperes; the share computed from them has rounding errors.
                shown = analog_share(io.standard_analog_output[number], voltage=bool(voltage))
                present = voltage, share if isclose(shown, share, abs_tol=1e-9) else shown
            yield ("analog", number), (types >> number & 1, share), present

    def _is_share(self, name: str) -> bool:
        if name not in self._held:
            return False
        value = self._number(name)
        if 0.0 <= value <= 1.0:
            return True
        self._warn(f"{name} is {value:g}: must be between 0 and 1")
        return False

    def _change(self, values: dict[Hashable, object], command: MakeCommand) -> None:
        if self._control.held_by_other:
            self._warn(
                "another client has control: speed and outputs stay as they are, and forces are not read"
            )
            return
        self._pending.ask(values)
        begin(self._answered(values, self._control.change(command)))

    async def _answered(self, values: dict[Hashable, object], reply: Awaitable[Reply]) -> None:
        answer = await reply
        self._pending.answered(values)
        if isinstance(answer, Refused):
            self._warn(answer.why)


def _present(io: Io, name: str) -> Number:
    bank, first, wire = REGISTERS[name]
    registers: list[int] | list[float] = getattr(io, f"{bank}_register")
    if wire is WireType.BOOL:
        return bool(int(registers[first // 32]) >> first % 32 & 1)
    return registers[first // 32 if wire is WireType.UINT32 else first]


def _runs(cells: dict[int, tuple[Number, bool]]) -> Iterator[tuple[int, tuple[Number, ...]]]:
    """Yield first number and values of each run of consecutive registers, from first to last new value."""
    for _, group in groupby(enumerate(sorted(cells)), lambda pair: pair[1] - pair[0]):
        new = [number for _, number in group if cells[number][1]]
        if new:
            yield new[0], tuple(cells[number][0] for number in range(new[0], new[-1] + 1))
