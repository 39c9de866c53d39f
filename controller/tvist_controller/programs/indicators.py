"""What programs show, and what watches them: clients that write too rarely, and threads that miss turns."""

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

SILENT = 5
"""Missed turns in a row after which the arm no longer keeps the velocity that was commanded last."""
_NAME = re.compile(r"input_(int|double|bit)_register_(\d+)|input_bit_registers(\d+)_to_(\d+)")
_BANKS: dict[str, tuple[Bank, int]] = {
    "int": ("input_int", NUMBERS), "double": ("input_double", NUMBERS), "bit": ("input_bit", BITS)
}  # fmt: skip
Group = Literal["digital", "analog", "bit"]
"""What an output is: a digital terminal, an analogue one, or an output bit register."""

SHOWS_UNTIL_FAILURE = 5
"""Largest of UR's numbers of what an output does that is simulated."""
_DOES = {
    1: (None, False, False),
    2: (None, True, True),
    3: (True, False, False),
    4: (None, None, False),
    SHOWS_UNTIL_FAILURE: (True, None, False),
}
"""What an output becomes when a program starts, when it runs no more, and when an error or a stop is why, by UR's
numbers; None leaves it as it is."""


class Popups:
    """The popup of one robot until somebody closes it; a newer one replaces it.

    It belongs to the program that runs when it is shown, which `owner` returns.
    """

    def __init__(self, emit: Emit, owner: Callable[[], object]) -> None:
        self._emit, self._owner = emit, owner
        self._owners: object | None = None

    def show(self, text: str, title: str, kind: PopupKind, *, blocking: bool) -> None:
        """Show a popup; `blocking` says that the program waits until it is closed."""
        self._owners = self._owner()
        self._emit("popup", why=text, title=title, level=kind, blocking=blocking)

    @property
    def shown(self) -> bool:
        """Whether there is a popup that nobody has closed."""
        return self._owners is not None

    def close(self, owner: object | None = None) -> None:
        """Close the popup; if a program is given, which has ended, only one of its own."""
        if owner is None or self._owners is owner:
            self._owners = None


class RunstateOutputs:
    """Sets outputs when the program begins to run, or runs no more since it is paused or has ended."""

    def __init__(self, peripherals: Peripherals) -> None:
        self._peripherals = peripherals
        self._choices: dict[tuple[Group, int], int] = {}
        self._runs = False

    def choose(self, group: Group, place: int, what: int) -> None:
        """Choose what an output does from now on, by UR's number; 0 leaves it to programs."""
        self._choices.pop((group, place), None)
        if what:
            self._choices[group, place] = what
            self._apply(group, place, what, failed=False)

    def tell(self, *, runs: bool, failed: bool = False) -> None:
        """Tell whether the program runs now, and if not whether an error or a stop is the reason."""
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
    ticks: int
    """Ticks that may pass between two writes."""
    action: str
    since: int


class Watchdogs:
    """The watchdogs of one robot's program, which watch input registers."""

    def __init__(self, peripherals: Peripherals) -> None:
        self._peripherals = peripherals
        self._all: dict[str, _Watchdog] = {}
        self._tick = 0

    def watch(self, name: str, frequency: float, action: str) -> None:
        """Watch an input of RTDE from now on, which has to be written with at least this frequency [Hz].

        The action is `pause`, `stop`, or `ignore` to watch it no more.
        """
        bank, place = _register(name)
        self._peripherals.changed = True
        if action == "ignore":
            self._all.pop(name, None)
            return
        ticks = max(round(1.0 / (frequency * PERIOD)), 1)
        self._all[name] = _Watchdog(name, bank, place, ticks, action, self._tick)

    @property
    def names(self) -> list[str]:
        """Names of the inputs that are watched."""
        return list(self._all)

    def clear(self) -> None:
        """Watch nothing any more, since the program has ended."""
        self._peripherals.changed |= bool(self._all)
        self._all.clear()

    def begin_anew(self, tick: int) -> None:
        """Begin anew to wait for writes, since the program is resumed at a tick."""
        for watchdog in self._all.values():
            watchdog.since = tick

    def expired(self, tick: int) -> tuple[str, str] | None:
        """Return the action of a watchdog whose register was not written in time, and the register's name."""
        self._tick = tick
        for watchdog in self._all.values():
            written = max(self._peripherals.written(watchdog.bank, watchdog.place), watchdog.since)
            if tick - written > watchdog.ticks:
                return watchdog.action, watchdog.name
        return None


def _register(name: str) -> tuple[Bank, int]:
    """Bank and number of a register by RTDE's name."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise Fault(f'"{name}" is no input register: it must be like "input_int_register_0"')
    kind, place, first, _ = match.groups()
    if first is not None:
        return "input_bit", int(first)
    bank, size = _BANKS[kind]
    if int(place) >= size:
        raise Fault(f'"{name}" does not exist: the bank has {size} registers')
    return bank, int(place)


class MissedTurns:
    """Warns of a thread that guides the arm and misses turns, since the budget of a tick is spent before.

    It slows the arm down if the thread misses several in a row.
    """

    def __init__(self, arm: ProgramArm, access: Access) -> None:
        self._arm, self._emit, self._guidance = arm, access.emit, access.guidance
        self._missed = 0
        self._warned = False

    def clear(self) -> None:
        """Warn anew, since another program begins."""
        self._missed, self._warned = 0, False

    def look(self, starved: set[object]) -> None:
        """Look at the thread that guides the arm, after all turns; of starved programs, no thread had one."""
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
