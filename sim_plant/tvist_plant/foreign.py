"""Wraps users' plants: adds missing methods, tests results, raises only PlantError, which stops one robot."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.plant import Condition, Measurement, Plant, PlantError, RealArm, RobotReport, SimulatedArm
from tvist_plant.user_file import named

_MEASURING = ("step", "reset", "measure")
_TELLING = ("truth", "play", "held", "modes")
_METHODS = [
    name
    for kind in (Plant, SimulatedArm, RealArm)
    for name, value in vars(kind).items()
    if callable(value) and not name.startswith("_") and name != "can"
]
MOST_KEPT = 10  # largest number of exceptions kept for `told`


def is_plant(value: object) -> bool:
    """Return whether an object has the minimum interface of a plant."""
    return hasattr(value, "payload") and callable(getattr(value, "step", None))


def arm_of(plant: Plant) -> Plant:
    """Return the plant, or if it derives from no class of `tvist_plant.plant`, a wrapper with all methods."""
    return plant if isinstance(plant, SimulatedArm | RealArm) else called(plant, None)


def called(plant: Plant, joints: int | None, *, untold: bool = False) -> Plant:
    """Return a wrapper turning exceptions into PlantError unless joints is None; `untold` hides the truth."""
    members: dict[str, Any] = {
        name: _method(name)
        for name in _METHODS
        if callable(getattr(plant, name, None)) and not (untold and name in _TELLING)
    }
    if hasattr(plant, "condition"):
        members["condition"] = property(lambda self: self.ask("condition", lambda: self.plant.condition))
    base = SimulatedArm if "reset" in members else RealArm
    return cast("Plant", type(type(plant).__name__, (_StandIn, base), members)(plant, joints))


def _method(name: str) -> Callable[..., Any]:
    def method(self: _StandIn, *given: Any, **options: Any) -> Any:
        return self.ask(name, lambda: getattr(self.plant, name)(*given, **options))

    return method


def told(plant: Plant) -> list[Exception]:
    """Return and clear the exceptions that methods of a plant have raised."""
    if not isinstance(plant, _StandIn) or not plant.raised:
        return []
    raised, plant.raised = plant.raised, []
    return raised


class _StandIn(Plant):
    """Wrapper of a plant that raises only `PlantError`."""

    def __init__(self, plant: Plant, joints: int | None) -> None:
        self.plant, self._joints = plant, joints
        self._payload = plant.payload
        self.raised: list[Exception] = []  # exceptions other than `PlantError`, until `told` returns them

    @property
    def payload(self) -> Payload:  # type: ignore[override]
        with suppress(PlantError):
            self._payload = self.ask("payload", lambda: self.plant.payload)
        return self._payload

    def can(self, method: Callable[..., Any]) -> bool:
        return super().can(method) and (not isinstance(self.plant, Plant) or self.plant.can(method))

    def ask(self, name: str, call: Callable[[], Any]) -> Any:
        if self._joints is None:
            return call()
        try:
            answer = call()
            self._check(name, answer, self._joints)
        except PlantError:
            raise
        except Exception as error:
            if len(self.raised) < MOST_KEPT:
                self.raised.append(error)
            raise PlantError(f"the arm's {name} raises {named(error)}") from error
        return answer

    def _check(self, name: str, answer: Any, joints: int) -> None:
        if name == "condition" and not isinstance(answer, Condition):
            raise TypeError(f"it is a {type(answer).__name__}: must be a Condition")
        if name in {"cycle_report", "latest_report"}:
            check_report(answer, joints)
        if name in _MEASURING:
            check_measurement(answer, joints, self.plant)
            felt = () if answer.wrench is None else answer.wrench
            if not np.isfinite(np.concatenate((answer.q, answer.qd, answer.moment, felt))).all():
                raise PlantError("the arm's measurements are not finite numbers")


def check_unpaced(plant: Plant) -> None:
    """Raise ValueError if a plant sets the tick itself and so cannot run faster than real time."""
    if plant.can(Plant.wait):
        name = type(plant).__name__
        raise ValueError(
            f"the plant {name} gives the tick: it moves in real time only, and not as fast as this machine computes"
        )


def measured_standing(plant: Plant, joints: int) -> Measurement:
    """Return the measured position of a plant that cannot be placed; raise ValueError if it is not known."""
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
    """Check the shapes of a plant's measurement; the ValueError names plant and field."""
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


def check_report(report: RobotReport, joints: int) -> None:
    """Check what a robot driven by its own controller reports; the ValueError names the field."""
    felt, load = report.measured, report.payload
    measured = np.concatenate((felt.q, felt.qd, felt.moment)).tolist()
    body = None if load is None else (load.mass, *load.com, *load.inertia)
    for name, said, count in (  # a finite sum means finite values; faster than numpy
        ("target", np.ravel(report.target).tolist(), 4 * joints), ("measured", measured, 3 * joints),
        ("modes", report.modes, 3), ("speed", (report.speed,), 1), ("tick", (report.tick,), 1),
        ("tool", report.tool, 6), ("force", report.force, 6), ("payload", body, 10),
    ):  # fmt: skip
        if said is not None and (len(said) != count or not math.isfinite(sum(said))):
            raise ValueError(f"{name} is {said}: must be {count} finite numbers")
    if report.slider is not None and not 0.0 <= report.slider <= 1.0:
        raise ValueError(f"slider is {report.slider:g}: must be 0 to 1")
