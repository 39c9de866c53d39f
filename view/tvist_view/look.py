"""What the page draws, as plain numbers: a robot's shape, and its position at one tick."""

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
    """Shape of a robot: its geometry and payload."""

    geometry: Geometry
    payload: Payload

    def __post_init__(self) -> None:
        """Raise GeometryError if it cannot be drawn."""
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
        """Return the message for the page."""
        return {
            "geometry": msgspec.to_builtins(self.geometry),
            "payload": {"mass": self.payload.mass, "com": self.payload.com},
        }

    def row(self, state: State, truth: Truth | None) -> list[float]:
        """Return the arm's position at a tick: 4 joints + 4 bending links values [rad], and 6 per body of its world.

        These are motor angles, reference, static gear deflection and its dynamic rest, then static part and
        rest for the two angles of each link that bends. Without truth the arm is stiff. Older servers do not
        send the static part, which then counts as zero. Bodies whose pose is unknown are NaN.
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
