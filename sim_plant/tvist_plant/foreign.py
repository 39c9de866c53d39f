"""Plants that somebody else has written: defaults for what they lack, checks of what they return, and their failures.

What a method of a served one raises, or measures wrongly, is a failure of the plant. So the robot stops and says why,
instead of the thread that ticks coming to its end with all its robots.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.plant import Condition, Measurement, Plant, PlantError, RealArm, Sight, SimulatedArm
from tvist_plant.user_file import named

_MEASURING = ("step", "reset", "measure")
_OPTIONAL = (
    "load", "mount", "grip", "opening", "switch", "stop", "wait", "push", "make_nan", "things", "places", "contact",
    "obstacle", "sight", "interval", "seen", "described",
)  # fmt: skip
_TELLING = ("truth", "play", "held", "modes")
MOST_KEPT = 10
"""Largest number of exceptions that are kept until `told` returns them."""


def is_plant(value: object) -> bool:
    """Return whether an object has what every plant has."""
    return hasattr(value, "payload") and callable(getattr(value, "step", None))


def arm_of(plant: Plant) -> Plant:
    """Return a plant with all methods: itself, or what stands for an object that derives from no class here."""
    if isinstance(plant, SimulatedArm | RealArm):
        return plant
    return _standing_for(plant, _StandIn, ())  # type: ignore[type-abstract]


def called(plant: Plant, joints: int, *, untold: bool = False) -> Plant:
    """Return what stands for a plant, with the same abilities, and raises only `PlantError`.

    Args:
        plant: Somebody's own plant, or a hidden one.
        joints: Number of joints in the robot's description.
        untold: Whether to leave out what a real arm could not tell.
    """
    found = _standing_for(plant, _Guarded, _TELLING if untold else ())  # type: ignore[type-abstract]
    cast("_Guarded", found).joints = joints
    return found


def told(plant: Plant) -> list[Exception]:
    """Return what methods of a plant have raised since the last call."""
    if not isinstance(plant, _Guarded) or not plant.raised:
        return []
    raised, plant.raised = plant.raised, []
    return raised


class _StandIn(Plant):
    """Stands for an object, and has its methods."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant

    @property
    def payload(self) -> Payload:  # type: ignore[override]
        return self.plant.payload

    def can(self, method: Callable[..., Any]) -> bool:
        own = super().can(method)
        return own and (not isinstance(self.plant, Plant) or self.plant.can(method))

    def ask(self, _: str, call: Callable[[], Any]) -> Any:
        return call()


class _Guarded(_StandIn):
    """Stands for a plant, none of whose exceptions but `PlantError` may be raised."""

    joints: int

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        self._payload = plant.payload
        self.raised: list[Exception] = []
        """Exceptions of its methods other than `PlantError`, until `told` returns them."""

    @property
    def payload(self) -> Payload:  # type: ignore[override]
        with suppress(PlantError):
            self._payload = self.ask("payload", lambda: self.plant.payload)
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
            check_sight(answer, self.joints)
        if name in _MEASURING:
            check_measurement(answer, self.joints, self.plant)
            felt = () if answer.wrench is None else answer.wrench
            if not np.isfinite(np.concatenate((answer.q, answer.qd, answer.moment, felt))).all():
                raise PlantError("the arm has measured what is no number")


def _standing_for(plant: Plant, kind: type[_StandIn], without: tuple[str, ...]) -> Plant:
    """Return a plant with the methods of an object; those that it lacks have their defaults."""
    names = [
        name
        for name in (*_MEASURING, *_OPTIONAL, *_TELLING)
        if name not in without and callable(getattr(plant, name, None))
    ]
    members: dict[str, Any] = {name: _method(name) for name in names}
    if hasattr(plant, "condition"):
        members["condition"] = property(lambda self: self.ask("condition", lambda: self.plant.condition))
    base = SimulatedArm if "reset" in members else RealArm
    return cast("Plant", type(type(plant).__name__, (kind, base), members)(plant))


def _method(name: str) -> Callable[..., Any]:
    def method(self: _StandIn, *given: Any, **options: Any) -> Any:
        return self.ask(name, lambda: getattr(self.plant, name)(*given, **options))

    return method


def check_unpaced(plant: Plant) -> None:
    """Check that a plant may be moved as fast as a machine computes, without a clock.

    Raises:
        ValueError: It gives the tick, so it may be a real arm.
    """
    if plant.can(Plant.wait):
        name = type(plant).__name__
        raise ValueError(
            f"the plant {name} gives the tick: it moves in real time only, and not as fast as this machine computes"
        )


def measured_standing(plant: Plant, joints: int) -> Measurement:
    """Return what a plant that cannot be placed measures where it stands.

    Raises:
        ValueError: The plant does not answer, or its measurement has the wrong shape or is not finite.
    """
    name = type(plant).__name__
    assert isinstance(plant, RealArm), f"plant {name}: a simulated arm is placed"
    try:
        measured = plant.measure()
    except PlantError as error:
        said = "" if plant.supervised else f"plant {name}: where it stands is unknown: "
        raise ValueError(f"{said}{error}") from error
    check_measurement(measured, joints, plant)
    if not np.isfinite(measured.q).all():
        raise ValueError(f"plant {name}: measured q is {measured.q.tolist()}: must be finite")
    return measured


def check_measurement(measured: Measurement, joints: int, plant: Plant) -> None:
    """Check the first measurement of a plant, which is named in the error.

    Raises:
        ValueError: An array is missing or has the wrong shape, for example for another number of joints.
    """
    shapes = {"q": (joints,), "qd": (joints,), "moment": (joints,), "accelerometer": (3,)}
    if getattr(measured, "wrench", None) is not None:
        shapes["wrench"] = (6,)
    for name, shape in shapes.items():
        found = getattr(getattr(measured, name, None), "shape", None)
        if found != shape:
            what = "is not an array" if found is None else f"has shape {found}"
            raise ValueError(
                f"plant {type(plant).__name__}: measured {name} {what}: its shape must be {shape}"
            )


def check_sight(sight: Sight, joints: int) -> None:
    """Check what a robot that its own controller moves has said; a `ValueError` names the field that is wrong."""
    felt, load = sight.measured, sight.payload
    measured = np.concatenate((felt.q, felt.qd, felt.moment)).tolist()
    body = None if load is None else (load.mass, *load.com, *load.inertia)
    for name, said, count in (  # whose sums are finite only if they are, and quicker to see than by numpy
        ("target", np.ravel(sight.target).tolist(), 4 * joints), ("measured", measured, 3 * joints),
        ("modes", sight.modes, 3), ("speed", (sight.speed,), 1), ("tick", (sight.tick,), 1),
        ("tool", sight.tool, 6), ("force", sight.force, 6), ("payload", body, 10),
    ):  # fmt: skip
        if said is not None and (len(said) != count or not math.isfinite(sum(said))):
            raise ValueError(f"{name} is {said}: must be {count} finite numbers")
    if sight.slider is not None and not 0.0 <= sight.slider <= 1.0:
        raise ValueError(f"slider is {sight.slider:g}: must be 0 to 1")
