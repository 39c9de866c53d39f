"""Popups and outputs of programs, and supervision: clients that write too rarely, threads that miss turns."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.programs.access import Access
from tvist_controller.programs.arm import ProgramArm
from tvist_plant.plant import PERIOD
from tvist_protocol.io import BITS, NUMBERS, Bank
from tvist_protocol.stream import PopupKind
from tvist_urscript import EVALUATIONS, Fault

SILENT = 5  # consecutive missed turns after which the arm slows down
_NAME = re.compile(r"input_(int|double|bit)_register_(\d+)|input_bit_registers(\d+)_to_(\d+)")
_BANKS: dict[str, tuple[Bank, int]] = {
    "int": ("input_int", NUMBERS), "double": ("input_double", NUMBERS), "bit": ("input_bit", BITS)
}  # fmt: skip
Group = Literal["digital", "analog", "bit"]
"""Kind of output: digital terminal, analogue terminal, or output bit register."""

SHOWS_UNTIL_FAILURE = 5  # largest simulated number of UR's output actions
_DOES = {
    1: (None, False, False),
    2: (None, True, True),
    3: (True, False, False),
    4: (None, None, False),
    SHOWS_UNTIL_FAILURE: (True, None, False),
}
"""Output value when a program starts, when it stops running, and after an error or stop, by UR's numbers;
None for no change."""


class Popups:
    """A robot's popup. Until closed or replaced, it belongs to the program that `owner` returned."""

    def __init__(self, emit: Emit, owner: Callable[[], object]) -> None:
        self._emit, self._owner = emit, owner
        self._owners: object | None = None

    def show(self, text: str, title: str, kind: PopupKind, *, blocking: bool) -> None:
        """Show a popup; a blocking one makes the program wait until it is closed."""
        self._owners = self._owner()
        self._emit("popup", why=text, title=title, level=kind, blocking=blocking)

    @property
    def shown(self) -> bool:
        """Whether a popup is open."""
        return self._owners is not None

    def close(self, owner: object | None = None) -> None:
        """Close the popup; with `owner`, a program that has ended, only if the popup is that program's."""
        if owner is None or self._owners is owner:
            self._owners = None


class RunstateOutputs:
    """Sets outputs when the program starts running, is paused or ends."""

    def __init__(self, peripherals: Peripherals) -> None:
        self._peripherals = peripherals
        self._choices: dict[tuple[Group, int], int] = {}
        self._runs = False

    def choose(self, group: Group, place: int, what: int) -> None:
        """Choose by UR's number what an output does in each state of the program; 0 leaves it to programs."""
        self._choices.pop((group, place), None)
        if what:
            self._choices[group, place] = what
            self._apply(group, place, what, failed=False)

    def tell(self, *, runs: bool, failed: bool = False) -> None:
        """Update the outputs; `failed` if an error or stop ended the program."""
        if runs == self._runs and not failed:
            return
        self._runs = runs
        for (group, place), what in self._choices.items():
            self._apply(group, place, what, failed=failed)

    def _apply(self, group: Group, place: int, what: int, *, failed: bool) -> None:
        at_start, at_end, at_failure = _DOES[what]
        on = at_start if self._runs else at_failure if failed else at_end
        if on is None:
            return
        match group:
            case "bit":
                self._peripherals.write("output_bit", place, on)
            case "digital":
                self._peripherals.set_digital_outputs(1 << place, on << place)
            case "analog":
                self._peripherals.set_analog_output(place, float(on))


@dataclass
class _Watchdog:
    name: str
    bank: Bank
    place: int
    ticks: int  # largest interval between two writes [ticks]
    action: str
    since: int


class Watchdogs:
    """Watchdogs of one robot's program for input registers."""

    def __init__(self, peripherals: Peripherals) -> None:
        self._peripherals = peripherals
        self._all: dict[str, _Watchdog] = {}
        self._tick = 0

    def watch(self, name: str, frequency: float, action: str) -> None:
        """Watch that an RTDE input is set at `frequency` [Hz]; else `pause` or `stop`. `ignore` ends this."""
        bank, place = _register(name)
        self._peripherals.changed = True
        if action == "ignore":
            self._all.pop(name, None)
            return
        ticks = max(round(1.0 / (frequency * PERIOD)), 1)
        self._all[name] = _Watchdog(name, bank, place, ticks, action, self._tick)

    @property
    def names(self) -> list[str]:
        """Names of the watched inputs."""
        return list(self._all)

    def clear(self) -> None:
        """End all watches after the program's end."""
        self._peripherals.changed |= bool(self._all)
        self._all.clear()

    def begin_anew(self, tick: int) -> None:
        """Restart all waits when the program is resumed."""
        for watchdog in self._all.values():
            watchdog.since = tick

    def expired(self, tick: int) -> tuple[str, str] | None:
        """Return action and register name of a watchdog that has expired, else None."""
        self._tick = tick
        for watchdog in self._all.values():
            written = max(self._peripherals.written(watchdog.bank, watchdog.place), watchdog.since)
            if tick - written > watchdog.ticks:
                return watchdog.action, watchdog.name
        return None


def _register(name: str) -> tuple[Bank, int]:
    """Return bank and number of a register by RTDE's name."""
    if (match := _NAME.fullmatch(name)) is None:
        raise Fault(f'"{name}" is no input register: it must be like "input_int_register_0"')
    kind, place, first, _ = match.groups()
    if first is not None:
        return "input_bit", int(first)
    bank, size = _BANKS[kind]
    if int(place) >= size:
        raise Fault(f'"{name}" does not exist: the bank has {size} registers')
    return bank, int(place)


class MissedTurns:
    """Warns about a guiding thread that misses turns for lack of budget; finally slows the arm down."""

    def __init__(self, arm: ProgramArm, access: Access) -> None:
        self._arm, self._emit, self._guidance = arm, access.emit, access.guidance
        self._missed = 0
        self._warned = False

    def clear(self) -> None:
        """Reset for another program."""
        self._missed, self._warned = 0, False

    def look(self, starved: set[object]) -> None:
        """After all turns, check the thread that guides the arm; programs in `starved` had no turn at all."""
        driver = self._arm.driver
        if driver is None or not (driver[0] in starved or driver[0].missed(driver[1])):
            self._missed = 0
            return
        self._missed += 1
        name, line = driver[0].place(driver[1])
        what = f"{name}, line {line}, guides the arm but had no turn within the {EVALUATIONS} evaluations of a tick"
        if not self._warned:
            self._warned = True
            self._emit("warning", why=f"{what}: its last command goes on; compute less between its commands")
        if self._missed == SILENT:
            self._emit(
                "warning", why=f"{what}, {SILENT} times in a row: the arm slows down until its next command"
            )
            self._guidance.slow_down()
