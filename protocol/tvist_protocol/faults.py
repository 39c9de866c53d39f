"""Faults that `simulation.inject` can cause, and what each needs to be told."""

from dataclasses import dataclass
from typing import Literal

Field = Literal["seconds", "value", "joint"]


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault.

    Attributes:
        meaning: A sentence, with the unit of `value`.
        needs: Fields that must be given; the others must not.
        may: Fields that may be.
    """

    meaning: str
    needs: tuple[Field, ...] = ()
    may: tuple[Field, ...] = ()


FAULTS: dict[str, Fault] = {
    "protective_stop": Fault("the robot makes a protective stop"),
    "reduced": Fault(
        "the safety system reduces the speed, as a guard that was opened does", may=("seconds",)
    ),
    "safeguard_stop": Fault(
        "a safeguard asks for a stop of category 2: the robot pauses, and goes on after `normal`",
        may=("seconds",),
    ),
    "emergency_stop": Fault(
        "the robot's emergency stop is pressed, category 1: it stops on its way, then its power is taken, and "
        "cannot be switched on before `normal`",
        may=("seconds",),
    ),
    "system_emergency_stop": Fault(
        "the same, by the emergency stop of the machine that the robot belongs to", may=("seconds",)
    ),
    "power_loss": Fault("the arm loses its power, category 0: the brakes bring it to rest at once"),
    "violation": Fault(
        "the safety system finds a limit violated, category 0: the brakes close; `restart_safety` ends it"
    ),
    "fault": Fault("the safety system itself fails, category 0; `restart_safety` ends it"),
    "normal": Fault("the safety system allows full speed again; safeguard and emergency stops are released"),
    "torque": Fault("something pushes a joint with `value` N m", ("joint", "value", "seconds")),
    "nan": Fault("the simulated arm's state becomes not a number"),
}
"""By name. One without `seconds` lasts until another ends it, or is over at once."""
