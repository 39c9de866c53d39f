"""The arm as a chain of frames: where its parts are at joint angles and with bent links."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvist_protocol.geometry import GEOMETRY_VERSION, Capsule, Geometry

Floats = npt.NDArray[np.float64]


class GeometryError(ValueError):
    """The robot's geometry cannot be drawn."""


@dataclass(frozen=True)
class Part:
    """A capsule of the arm, in the frame that carries it."""

    name: str
    frame: int
    """Index into what `Chain.frames` returns."""
    start: Floats
    """One end of its axis, shape (3,) [m]."""
    end: Floats
    """Other end, shape (3,) [m]."""
    radius: float
    """[m]."""


class Chain:
    """Frames of an arm: the base, then for each joint the near and the far end of its link.

    Both are the link's Denavit-Hartenberg frame. They differ where the link bends: the near one does not take part in
    the bending, the far one does.

    Attributes:
        parts: What to draw; a capsule of a bending link is cut in the middle of the link.

    Raises:
        GeometryError: The description is of an unknown version, or its lists do not fit together.
    """

    parts: tuple[Part, ...]

    def __init__(self, geometry: Geometry) -> None:
        if geometry.version != GEOMETRY_VERSION:
            raise GeometryError(
                f"the robot describes its geometry in version {geometry.version}, this program knows version "
                f"{GEOMETRY_VERSION}: update it"
            )
        self.joints = len(geometry.a)
        if not geometry.a:
            raise GeometryError(
                "the robot has no Denavit-Hartenberg parameters: an arm from a URDF cannot be drawn"
            )
        if not len(geometry.d) == len(geometry.alpha) == self.joints:
            raise GeometryError("the robot's geometry has lists of different lengths")
        if any(not 0 <= link < self.joints for link in geometry.bending) or any(
            not -1 <= capsule.link < self.joints for capsule in geometry.capsules
        ):
            raise GeometryError("the robot's geometry names a link that does not exist")
        self.bending = tuple(geometry.bending)
        self._links = [_link(*values) for values in zip(geometry.a, geometry.d, geometry.alpha, strict=True)]
        self._middles = [_shift(a / 2, 0.0, d) for a, d in zip(geometry.a, geometry.d, strict=True)]
        self.parts = tuple(part for capsule in geometry.capsules for part in self._parts(capsule))

    def frames(self, q: Sequence[float] | Floats, bends: Sequence[float] | Floats = ()) -> Floats:
        """Frames of the base and, per joint, of its link's near and far end, shape (1 + 2 joints, 4, 4).

        Args:
            q: Joint angles on the link side, shape (joints,) [rad].
            bends: Two angles per bending link, about y and z [rad]; empty: no link bends.
        """
        if len(bends) not in (0, 2 * len(self.bending)):
            raise GeometryError(f"{len(bends)} link deflections for {len(self.bending)} bending links")
        out = np.empty((1 + 2 * self.joints, 4, 4))
        out[0] = at = np.eye(4)
        pairs = dict(zip(self.bending, zip(bends[::2], bends[1::2], strict=True), strict=bool(len(bends))))
        for joint, (angle, link, middle) in enumerate(zip(q, self._links, self._middles, strict=True)):
            at = at @ _turn_z(float(angle))
            out[1 + 2 * joint] = at @ link
            if joint in pairs:
                about_y, about_z = pairs[joint]
                at = at @ middle @ _turn_y(float(about_y)) @ _turn_z(float(about_z)) @ np.linalg.inv(middle)
            at = at @ link
            out[2 + 2 * joint] = at
        return out

    def flange(self, q: Sequence[float] | Floats, bends: Sequence[float] | Floats = ()) -> Floats:
        """Pose of the flange, shape (4, 4); see `frames`."""
        return np.asarray(self.frames(q, bends)[-1])

    def _parts(self, capsule: Capsule) -> list[Part]:
        start, end = np.array(capsule.start, dtype=float), np.array(capsule.end, dtype=float)
        if capsule.link < 0:
            return [Part(capsule.name, 0, start, end, capsule.radius)]
        near, far = 1 + 2 * capsule.link, 2 + 2 * capsule.link
        if capsule.link not in self.bending:
            return [Part(capsule.name, far, start, end, capsule.radius)]
        # In the link's own frame, which is at its far end, the joint lies at x = -a and the middle at -a/2.
        middle = float((np.linalg.inv(self._links[capsule.link]) @ self._middles[capsule.link])[0, 3])
        joint_side = np.sign(middle)
        ends = sorted((start, end), key=lambda point: -joint_side * point[0])
        if not (ends[0][0] - middle) * joint_side > 0.0 > (ends[1][0] - middle) * joint_side:
            frame = near if (ends[1][0] - middle) * joint_side >= 0.0 else far
            return [Part(capsule.name, frame, start, end, capsule.radius)]
        share = (middle - ends[0][0]) / (ends[1][0] - ends[0][0])
        cut = ends[0] + share * (ends[1] - ends[0])
        return [
            Part(f"{capsule.name}_near", near, ends[0], cut, capsule.radius),
            Part(f"{capsule.name}_far", far, cut, ends[1], capsule.radius),
        ]


def _link(a: float, d: float, alpha: float) -> Floats:
    c, s = np.cos(alpha), np.sin(alpha)
    return np.array([[1.0, 0.0, 0.0, a], [0.0, c, -s, 0.0], [0.0, s, c, d], [0.0, 0.0, 0.0, 1.0]])


def _shift(x: float, y: float, z: float) -> Floats:
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def _turn_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def _turn_y(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s, 0.0], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 0.0], [0.0, 0.0, 0.0, 1.0]])
