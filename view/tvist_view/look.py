"""What the page draws: a robot's shape and its position at one tick, as plain numbers, and mesh files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from tvist_plant.model import rotation_of
from tvist_protocol.geometry import GEOMETRY_VERSION, Geometry
from tvist_protocol.stream import State, Truth
from tvist_protocol.values import Payload

Floats = npt.NDArray[np.float64]
MESHES = (".stl", ".obj", ".dae")  # suffixes of mesh files that the page can draw
LARGEST = 64 * 2**20  # largest mesh file that is offered [byte]


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
                f"geometry is of version {geometry.version}: this program draws version {GEOMETRY_VERSION}, so "
                "update the older of program and robot"
            )
        if not self.joints:
            raise GeometryError("geometry has no joints: must be at least one")
        a, d, alpha = len(geometry.a), len(geometry.d), len(geometry.alpha)
        if not geometry.placement and not a == d == alpha:
            raise GeometryError(f"geometry has {a} a, {d} d and {alpha} alpha: must be equally many")
        parts = [part.link for part in geometry.capsules] + [mesh.link for mesh in geometry.meshes]
        for least, links in ((0, geometry.bending), (-1, parts)):
            if wrong := [link for link in links if not least <= link < self.joints]:
                raise GeometryError(f"geometry names link {wrong[0]}: must be {least} to {self.joints - 1}")

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.geometry.placement or self.geometry.a)

    @property
    def turns(self) -> list[Floats]:
        """Rotation of each link's frame in that of its joint, shape (3, 3)."""
        angles = [row[3:] for row in self.geometry.placement]
        return [rotation_of(*one) for one in angles or [(alpha, 0.0, 0.0) for alpha in self.geometry.alpha]]

    @property
    def reach(self) -> float:
        """Sum of the links' lengths [m]."""
        offsets = [row[:3] for row in self.geometry.placement]
        return sum(math.hypot(*one) for one in offsets or zip(self.geometry.a, self.geometry.d, strict=True))

    def packed(self) -> dict[str, Any]:
        """Return the message for the page."""
        return {
            "geometry": msgspec.to_builtins(self.geometry),
            "payload": {"mass": self.payload.mass, "com": self.payload.com},
        }

    def row(self, state: State, truth: Truth | None) -> list[float]:
        """Return the arm's position at a tick: 4 values per joint and bending link [rad], 6 per world body.

        They are motor angles, reference, static and dynamic part of the gears' deflections, then static and
        dynamic part of each bending link's two angles. Without truth, deflections are zero. Older servers
        do not send static parts: the whole deflection is then the dynamic part. Unknown body poses are NaN.
        """
        bends = 2 * len(self.geometry.bending)
        bodies = [math.nan] * (0 if self.geometry.world is None else 6 * len(self.geometry.world.bodies))
        if truth is None:
            return [*state.actual_q, *state.reference_q, *[0.0] * (2 * self.joints + 2 * bends), *bodies]
        if len(truth.body_poses) == len(bodies):
            bodies = truth.body_poses
        return [
            *truth.motor_q,
            *state.reference_q,
            *_parts(truth.gear_deflection, truth.static_gear_deflection, self.joints),
            *_parts(truth.link_deflection, truth.static_link_deflection, bends),
            *bodies,
        ]


def _parts(deflection: Sequence[float], static: Sequence[float], count: int) -> list[float]:
    if len(deflection) != count:
        raise GeometryError(f"{len(deflection)} deflections where the robot's geometry has {count}")
    known = static if len(static) == count else [0.0] * count
    return [*known, *(whole - part for whole, part in zip(deflection, known, strict=True))]


class Meshes:
    """Mesh files on this machine that robots' geometries name, each with a path on the page's server."""

    def __init__(self) -> None:
        self._paths: dict[Path, str] = {}

    def offer(self, geometry: Geometry) -> list[str]:
        """Return a robot's mesh paths; if any is missing or unsuitable, none: the page draws a simple arm."""
        found = [Path(mesh.file) for mesh in geometry.meshes]
        if not all(
            file.suffix.lower() in MESHES and file.is_file() and file.stat().st_size <= LARGEST
            for file in found
        ):
            return []
        for file in found:
            # A robot that reconnects keeps its paths.
            self._paths.setdefault(file, f"/mesh/{len(self._paths)}{file.suffix.lower()}")
        return [self._paths[file] for file in found]

    def content(self, path: str) -> bytes | None:
        """Return the content of an offered file; None for another path."""
        return next((file.read_bytes() for file, its in self._paths.items() if its == path), None)
