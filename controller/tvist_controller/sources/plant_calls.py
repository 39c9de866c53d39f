"""Calls of somebody's own plant: what one of its methods raises, or measures wrongly, is a failure of the plant.

So the robot stops and says why, instead of the thread that ticks coming to its end with all its robots.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.plant import Condition, Plant, PlantError
from tvist_plant.plant_checks import check_measurement, check_sight
from tvist_plant.user_file import named

_MEASURING = ("step", "reset", "measure")
_OTHERS = (
    "truth", "switch", "stop", "wait", "sight", "interval", "load", "push", "make_nan", "play", "held", "modes", "seen",
    "described", "things", "places", "contact", "mount", "grip", "opening",
    "obstacle",
)  # fmt: skip
_TELLING = ("truth", "play", "held", "modes")
MOST_KEPT = 10
"""Largest number of exceptions that are kept until they are told."""


class _Called:
    """Stands for a plant, and has its abilities."""

    def __init__(self, plant: Plant, joints: int) -> None:
        self._plant, self._joints, self._payload = plant, joints, plant.payload
        self.raised: list[Exception] = []
        """What its methods have raised that is no `PlantError`, until it is told."""

    @property
    def payload(self) -> Payload:
        """Carried payload, as far as it is known."""
        with suppress(PlantError):
            self._payload = self.ask("payload", lambda: self._plant.payload)
        return self._payload

    def ask(self, name: str, call: Callable[[], Any]) -> Any:
        try:
            answer = call()
            self._check(name, answer)
        except PlantError:
            raise
        except Exception as error:
            if len(self.raised) < MOST_KEPT:
                self.raised.append(error)
            raise PlantError(f"the arm's {name} raises {named(error)}") from error
        return answer

    def _check(self, name: str, answer: Any) -> None:
        if name == "condition" and not isinstance(answer, Condition):
            raise TypeError(f"it is a {type(answer).__name__}, and must be a Condition")
        if name in {"sight", "seen"}:
            check_sight(answer, self._joints)
        if name in _MEASURING:
            check_measurement(answer, self._joints, self._plant)
            felt = () if answer.wrench is None else answer.wrench
            if not np.isfinite(np.concatenate((answer.q, answer.qd, answer.moment, felt))).all():
                raise PlantError("the arm has measured what is no number")


def called(plant: Plant, joints: int, *, untold: bool = False) -> Plant:
    """Return what stands for a plant, with the same abilities, and raises only `PlantError`.

    Args:
        plant: Somebody's own plant, or a hidden one.
        joints: Number of joints in the robot's description.
        untold: Whether to leave out what a real arm could not tell.
    """
    kept = (name for name in (*_MEASURING, *_OTHERS) if not (untold and name in _TELLING))
    members: dict[str, Any] = {name: _method(name) for name in kept if callable(getattr(plant, name, None))}
    if hasattr(plant, "condition"):
        members["condition"] = property(lambda self: self.ask("condition", lambda: self._plant.condition))
    return cast("Plant", type(type(plant).__name__, (_Called,), members)(plant, joints))


def told(plant: Plant) -> list[Exception]:
    """Return what methods of a plant have raised since the last call."""
    if not isinstance(plant, _Called) or not plant.raised:
        return []
    raised, plant.raised = plant.raised, []
    return raised


def _method(name: str) -> Callable[..., Any]:
    def method(self: _Called, *given: Any, **options: Any) -> Any:
        return self.ask(name, lambda: getattr(self._plant, name)(*given, **options))

    return method
