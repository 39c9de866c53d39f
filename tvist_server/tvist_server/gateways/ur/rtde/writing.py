"""Turns the input variables of data packages into commands, omitting values that are already in force."""

from collections.abc import Awaitable, Callable, Hashable, Iterable, Iterator
from math import isclose

from tvist_controller.instruments.peripherals import analog_share
from tvist_protocol.commands import SetSpeed
from tvist_protocol.forces import SetExternalWrench
from tvist_protocol.io import Bank, Io, Registers, SetIo, SetRegisters
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.ur.deferred import begin
from tvist_server.gateways.ur.lease import ConnectionControl, MakeCommand
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.inputs import DIGITAL, REGISTERS
from tvist_server.gateways.ur.rtde.recipes import Value
from tvist_server.rtde.wire import WireType

Number = bool | int | float
LARGEST = 1e308  # largest absolute value of an input; infinity and NaN are refused


class InputWriter:
    """Sets the inputs of one connection; missing ones keep their last value, and a mask is 0 before its first."""

    def __init__(self, robot: UrRobot, control: ConnectionControl, complain: Callable[[str], None]) -> None:
        self._robot = robot
        self._control = control
        self._complain = complain
        self._pending = robot.inputs.pending
        self._held: dict[str, Value] = {}

    def write(self, values: dict[str, Value]) -> None:
        """Set the variables of one package; values that are not finite are refused individually."""
        for name, value in values.items():
            numbers = value if isinstance(value, tuple) else (value,)
            if not all(abs(number) <= LARGEST for number in numbers):
                self._complain(f"{name} is {value}: must be a number within ±{LARGEST:g}")
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
        """Set, in one command, the digital and analogue outputs that the variables of a package refer to."""
        groups = {name.partition("_output")[0] for name in values}
        digital = {bit: on for bit, on in self._digital(groups) if self._is_digital_news(bit, on)}
        analog: dict[int, tuple[int, float]] = {}
        if "standard_analog" in groups:
            analog = {number: kind for number, kind in self._analog() if self._is_analog_news(number, *kind)}
        if not digital and not analog:
            return
        ratios = [analog[number][1] if number in analog else 0.0 for number in range(2)]
        news: dict[Hashable, object] = {("digital", bit): on for bit, on in digital.items()}
        news |= {("analog", number): kind for number, kind in analog.items()}
        self._change(
            news,
            lambda token: SetIo(
                token=token,
                digital_output_mask=sum(1 << bit for bit in digital),
                digital_outputs=sum(1 << bit for bit, on in digital.items() if on),
                standard_analog_output_mask=sum(1 << number for number in analog),
                standard_analog_output_type=sum(kind << number for number, (kind, _) in analog.items()),
                standard_analog_output_0=ratios[0],
                standard_analog_output_1=ratios[1],
            ),
        )

    def _digital(self, groups: set[str]) -> Iterator[tuple[int, bool]]:
        """Yield number and value of each digital output in these groups that the mask selects."""
        for group, (first, count) in DIGITAL.items():
            if f"{group}_digital" not in groups or f"{group}_digital_output" not in self._held:
                continue
            mask = int(self._number(f"{group}_digital_output_mask"))
            wanted = int(self._number(f"{group}_digital_output"))
            for bit in range(count):
                if mask >> bit & 1:
                    yield first + bit, bool(wanted >> bit & 1)

    def _is_digital_news(self, bit: int, on: bool) -> bool:
        io = self._io
        present = None if io is None else bool(io.actual_digital_output_bits >> bit & 1)
        return self._pending.changed(("digital", bit), on, present)

    def _analog(self) -> Iterator[tuple[int, tuple[int, float]]]:
        """Yield number, type and share of the range of each analogue output that the mask selects."""
        mask, types = (int(self._number(f"standard_analog_output_{part}")) for part in ("mask", "type"))
        for number in range(2):
            name = f"standard_analog_output_{number}"
            if mask >> number & 1 and self._is_share(name):
                yield number, (types >> number & 1, float(self._number(name)))

    def _is_analog_news(self, number: int, kind: int, ratio: float) -> bool:
        io = self._io
        present: tuple[int, float] | None = None
        if io is not None:
            value, voltage = io.standard_analog_output[number], io.analog_io_types >> (2 + number) & 1
            # The robot publishes volts or amperes; the share computed from them has rounding errors.
            shown = analog_share(value, voltage=bool(voltage))
            present = voltage, ratio if isclose(shown, ratio, abs_tol=1e-9) else shown
        return self._pending.changed(("analog", number), (kind, ratio), present)

    def _is_share(self, name: str) -> bool:
        if name not in self._held:
            return False
        value = self._number(name)
        if 0.0 <= value <= 1.0:
            return True
        self._complain(f"{name} is {value:g}: must be between 0 and 1")
        return False

    def _change(self, values: dict[Hashable, object], command: MakeCommand) -> None:
        if self._control.held_by_other:
            self._complain(
                "another client has control: speed and outputs stay as they are, and forces are not read"
            )
            return
        self._pending.ask(values)
        begin(self._answered(values, self._control.change(command)))

    async def _answered(self, values: dict[Hashable, object], reply: Awaitable[Reply]) -> None:
        answer = await reply
        self._pending.answered(values)
        if isinstance(answer, Refused):
            self._complain(answer.why)


def _present(io: Io, name: str) -> Number:
    bank, first, wire = REGISTERS[name]
    registers: list[int] | list[float] = getattr(io, f"{bank}_register")
    if wire is WireType.BOOL:
        return bool(int(registers[first // 32]) >> first % 32 & 1)
    return registers[first // 32 if wire is WireType.UINT32 else first]


def _runs(cells: dict[int, tuple[Number, bool]]) -> Iterator[tuple[int, tuple[Number, ...]]]:
    """Group registers with consecutive numbers; each group spans its first to its last new value."""
    run: list[Number] = []
    first = end = 0
    for number in [*sorted(cells), None]:
        if run and (number is None or number != first + len(run)):
            yield first, tuple(run[:end])
            run = []
        if number is None:
            return
        value, new = cells[number]
        if not run and not new:
            continue
        if not run:
            first = number
        run.append(value)
        if new:
            end = len(run)
