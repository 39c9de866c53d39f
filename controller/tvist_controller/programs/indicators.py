"""What programs show: messages to people, and outputs that tell whether the program runs."""

from collections.abc import Callable
from typing import Literal

from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_protocol.stream import PopupKind

Group = Literal["digital", "analog", "bit"]
"""What an output is: a digital terminal, an analogue one, or an output bit register."""

LOW, HIGH, SHOWS, LOW_AFTER_FAILURE, SHOWS_UNTIL_FAILURE = 1, 2, 3, 4, 5
"""UR's numbers of what an output does: low, or high, while no program runs; high while one runs, else low; low when one
ends by an error or a stop; and that, with high from the start of a program on."""


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

    def close(self, owner: object) -> None:
        """Close the popup if it is that of a program, which has ended."""
        if self._owners is owner:
            self._owners = None

    def dismiss(self) -> None:
        """Close the popup, whichever program shows it."""
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
        if what in {SHOWS, SHOWS_UNTIL_FAILURE} and self._runs:
            self._set(group, place, on=True)
        elif not self._runs and what in {LOW, HIGH, SHOWS}:
            self._set(group, place, on=what == HIGH)
        elif failed and what in {LOW_AFTER_FAILURE, SHOWS_UNTIL_FAILURE}:
            self._set(group, place, on=False)

    def _set(self, group: Group, place: int, *, on: bool) -> None:
        match group:
            case "bit":
                self._peripherals.write("output_bit", place, on)
            case "digital":
                self._peripherals.set_digital_outputs(1 << place, on << place)
            case "analog":
                self._peripherals.set_analog_output(place, float(on))
