"""What a run is expected to leave behind: a body of the arm's world in one of its areas."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tvist_lab.programs.limits import Shortcoming
from tvist_plant.model import Floats
from tvist_plant.plant import Plant, Shape

_EXPECTED = re.compile(r"(?P<body>.+?) in (?P<area>.+)")


class ExpectationError(ValueError):
    """What is expected is not said as `BODY in AREA`; the message says how."""


@dataclass(frozen=True)
class Expectation:
    """A body whose origin is to be in an area at the end."""

    body: str
    area: str

    @classmethod
    def of(cls, text: str) -> "Expectation":
        """Read `BODY in AREA`.

        Raises:
            ExpectationError: It is something else.
        """
        found = _EXPECTED.fullmatch(text.strip())
        if found is None:
            raise ExpectationError(f"expect is {text!r}: must be BODY in AREA, such as 'box 1 in pallet'")
        return cls(found["body"].strip(), found["area"].strip())

    def missed(self, plant: Plant) -> Shortcoming | None:
        """Say why a plant is not as expected; None if it is."""
        things, places = plant.things(), plant.places()
        if things is None:
            return _no(f"{self.body} cannot be in {self.area}: the arm stands in no world (--world)")
        for kind, name, known in (
            ("body", self.body, things.bodies),
            ("area", self.area, tuple(things.areas)),
        ):
            if name not in known:
                names = ", ".join(known) or "none"
                return _no(f"the world {things.name} has no {kind} {name!r}: it has {names}")
        at, area = places[things.bodies.index(self.body), :3], things.areas[self.area]
        if _is_inside(area, _frame(area, places).actInv(at)):
            return None
        where = ", ".join(f"{value:.3f}" for value in at)
        return _no(f"{self.body} is at ({where}) m, which is not in {self.area}")


def missed(expected: Sequence[Expectation], plant: Plant) -> list[Shortcoming]:
    """Say what is not as expected."""
    return [found for one in expected if (found := one.missed(plant)) is not None]


def _no(text: str) -> Shortcoming:
    return Shortcoming("expect", f"{text} (--expect)")


def _se3(pose: Sequence[float] | Floats) -> pin.SE3:
    return pin.SE3(pin.exp3(np.array(pose[3:])), np.array(pose[:3]))


def _frame(area: Shape, places: Floats) -> pin.SE3:
    own = _se3(area.pose)
    return own if area.body is None else _se3(places[area.body]) * own


def _is_inside(area: Shape, at: Floats) -> bool:
    size = np.array(area.size)
    match area.kind:
        case "box":
            return bool((np.abs(at) <= size).all())
        case "sphere":
            return bool(np.linalg.norm(at) <= size[0])
        case "ellipsoid":
            return bool(np.linalg.norm(at / size) <= 1.0)
        case "cylinder":
            return bool(np.hypot(*at[:2]) <= size[0] and abs(at[2]) <= size[1])
    nearest = np.array([0.0, 0.0, np.clip(at[2], -size[1], size[1])])  # a capsule
    return bool(np.linalg.norm(at - nearest) <= size[0])
