"""What the page draws: how a robot looks, and where it is at one tick, as plain numbers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from tvist_protocol.geometry import GEOMETRY_VERSION, Geometry
from tvist_protocol.stream import State, Truth
from tvist_protocol.values import Payload

Floats = npt.NDArray[np.float64]


class GeometryError(ValueError):
    """The robot's geometry cannot be drawn."""


@dataclass(frozen=True)
class Look:
    """How one robot looks."""

    geometry: Geometry
    payload: Payload

    def __post_init__(self) -> None:
        """Check that it can be drawn."""
        geometry = self.geometry
        if geometry.version != GEOMETRY_VERSION:
            raise GeometryError(
                f"the robot describes its geometry in version {geometry.version}, this program knows version "
                f"{GEOMETRY_VERSION}: update it"
            )
        if not self.joints:
            raise GeometryError("the robot's geometry has no joints")
        if not geometry.placement and not len(geometry.d) == len(geometry.alpha) == self.joints:
            raise GeometryError("the robot's geometry has lists of different lengths")
        links = [part.link for part in geometry.capsules] + [mesh.link for mesh in geometry.meshes]
        if any(not 0 <= link < self.joints for link in geometry.bending) or any(
            not -1 <= link < self.joints for link in links
        ):
            raise GeometryError("the robot's geometry names a link that does not exist")

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.geometry.placement or self.geometry.a)

    @property
    def turns(self) -> list[Floats]:
        """Rotation of each link's frame in that of its joint, shape (3, 3)."""
        if not self.geometry.placement:
            return [_about(0, angle) for angle in self.geometry.alpha]
        return [
            _about(2, yaw) @ _about(1, pitch) @ _about(0, roll)
            for *_, roll, pitch, yaw in self.geometry.placement
        ]

    @property
    def reach(self) -> float:
        """Sum of the links' lengths [m]."""
        if self.geometry.placement:
            return sum(math.hypot(x, y, z) for x, y, z, *_ in self.geometry.placement)
        return sum(map(math.hypot, self.geometry.a, self.geometry.d))

    def packed(self) -> dict[str, Any]:
        """What the page is told."""
        return {
            "geometry": msgspec.to_builtins(self.geometry),
            "payload": {"mass": self.payload.mass, "com": self.payload.com},
        }

    def row(self, state: State, truth: Truth | None) -> list[float]:
        """Where the arm is at a tick, 4 joints + 4 bending links values [rad], and 6 for each body of its world.

        They are motor angles, reference, static gear deflection and the rest of it, and both again for the two angles
        of each link that bends. Without truth the arm is stiff. An older server does not tell the static part; it
        counts as zero. Bodies whose place is unknown are nowhere (NaN).
        """
        bends = 2 * len(self.geometry.bending)
        bodies = [math.nan] * (0 if self.geometry.world is None else 6 * len(self.geometry.world.bodies))
        if truth is None:
            return [*state.actual_q, *state.reference_q, *[0.0] * (2 * self.joints + 2 * bends), *bodies]
        if len(truth.body_poses) == len(bodies):
            bodies = truth.body_poses
        gears = _parts(truth.gear_deflection, truth.static_gear_deflection, self.joints)
        return [
            *truth.motor_q,
            *state.reference_q,
            *gears,
            *_parts(truth.link_deflection, truth.static_link_deflection, bends),
            *bodies,
        ]


def _parts(deflection: Sequence[float], static: Sequence[float], count: int) -> list[float]:
    if len(deflection) != count:
        raise GeometryError(f"{len(deflection)} deflections where the robot's geometry has {count}")
    known = static if len(static) == count else [0.0] * count
    return [*known, *(whole - part for whole, part in zip(deflection, known, strict=True))]


def _about(axis: int, angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    out = np.eye(3)
    first, second = ((1, 2), (2, 0), (0, 1))[axis]
    out[first, first] = out[second, second] = c
    out[first, second], out[second, first] = -s, s
    return out
