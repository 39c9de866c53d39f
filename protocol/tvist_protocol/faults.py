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
    "normal": Fault("the safety system allows full speed again"),
    "torque": Fault("something pushes a joint with `value` N m", ("joint", "value", "seconds")),
    "nan": Fault("the simulated arm's state becomes not a number"),
}
"""By name. One without `seconds` lasts until another ends it, or is over at once."""
