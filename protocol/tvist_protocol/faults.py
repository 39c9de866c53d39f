"""Faults that `simulation.inject` can cause, and the fields that each needs."""

from dataclasses import dataclass
from typing import Literal

Field = Literal["seconds", "value", "joint"]


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault."""

    meaning: str  # description, with the unit of `value`
    needs: tuple[Field, ...] = ()  # required fields
    may: tuple[Field, ...] = ()  # optional fields; any other field is refused


FAULTS: dict[str, Fault] = {
    "protective_stop": Fault("the robot makes a protective stop"),
    "reduced": Fault(
        "the safety system reduces the speed, as it does when a guard is opened", may=("seconds",)
    ),
    "safeguard_stop": Fault(
        "a safeguard demands a stop of category 2: the robot pauses, and continues after `normal`",
        may=("seconds",),
    ),
    "emergency_stop": Fault(
        "the robot's emergency stop is pressed, category 1: the robot stops on its path, then its power is switched "
        "off and cannot be switched on before `normal`",
        may=("seconds",),
    ),
    "system_emergency_stop": Fault(
        "the emergency stop of the machine that contains the robot is pressed; otherwise as `emergency_stop`",
        may=("seconds",),
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
"""Faults by name. A fault without `seconds` is over at once or lasts until another fault ends it."""
