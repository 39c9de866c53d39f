"""Outputs that show whether the program runs."""

from typing import Literal

from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.programs.moves import OWN_TOKEN
from tvist_protocol.io import SetIo

Group = Literal["digital", "analog", "bit"]
"""What an output is: a digital terminal, an analogue one, or an output bit register."""

LOW, HIGH, SHOWS, LOW_AFTER_FAILURE, SHOWS_UNTIL_FAILURE = 1, 2, 3, 4, 5
"""UR's numbers of what an output does: low, or high, while no program runs; high while one runs, else low; low when one
ends by an error or a stop; and that, with high from the start of a program on."""
MOST = SHOWS_UNTIL_FAILURE


class RunstateOutputs:
    """Sets outputs when the program begins to run, or runs no more since it is paused or has ended.

    Args:
        peripherals: The outputs of the robot.
    """

    def __init__(self, peripherals: Peripherals) -> None:
        self._peripherals = peripherals
        self._choices: dict[tuple[Group, int], int] = {}
        self._runs = False

    def choose(self, group: Group, place: int, what: int) -> None:
        """Choose what an output does from now on, by UR's number up to `MOST`; 0 leaves it to programs."""
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
        if group == "bit":
            self._peripherals.write("output_bit", place, on)
        elif group == "digital":
            command = SetIo(token=OWN_TOKEN, digital_output_mask=1 << place, digital_outputs=int(on) << place)
            self._peripherals.set_outputs(command)
        else:
            self._peripherals.set_outputs(
                SetIo(
                    token=OWN_TOKEN,
                    standard_analog_output_mask=1 << place,
                    standard_analog_output_type=int(self._peripherals.output_is_voltage(place)) << place,
                    standard_analog_output_0=float(on),
                    standard_analog_output_1=float(on),
                )
            )
