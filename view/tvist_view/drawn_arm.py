"""An arm in the page's scene."""

import numpy as np
import trimesh
from viser import FrameHandle, SceneApi

from tvist_protocol.values import Payload
from tvist_view.chain import Chain, Floats

Colour = tuple[int, int, int]

BODY: Colour = (214, 219, 224)
CAP: Colour = (72, 132, 190)
GHOST: Colour = (90, 90, 90)
LOAD: Colour = (150, 110, 70)
GHOST_OPACITY = 0.25
CAP_SHARE = 1.1
"""Radius of a joint's cap over that of the thicker part beside it [-]."""


class DrawnArm:
    """One arm; `move` puts it where it is to be.

    Args:
        scene: Scene of the page.
        name: Name of its root in the scene, `/arm`.
        chain: Its geometry.
        payload: What to draw on the flange.
        payload_radius: Radius of that [m].
        at: Where its base stands in the scene, shape (3,) [m].
        ghost: Draw it grey and transparent.
        colour: Colour of its joints' caps.
    """

    def __init__(
        self,
        scene: SceneApi,
        name: str,
        chain: Chain,
        *,
        payload: Payload,
        payload_radius: float,
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
        ghost: bool = False,
        colour: Colour = CAP,
    ) -> None:
        self._chain = chain
        self.root = scene.add_frame(name, show_axes=False, position=at)
        self._frames: list[FrameHandle] = [
            scene.add_frame(f"{name}/{number}", show_axes=False) for number in range(1 + 2 * chain.joints)
        ]
        self.at = np.array(at)
        body, caps = (GHOST, GHOST) if ghost else (BODY, colour)
        opacity = GHOST_OPACITY if ghost else None

        def add(frame: int, label: str, mesh: trimesh.Trimesh, what: Colour) -> None:
            scene.add_mesh_simple(
                f"{name}/{frame}/{label}",
                np.asarray(mesh.vertices),
                np.asarray(mesh.faces),
                color=what,
                opacity=opacity,
                cast_shadow=not ghost,
                receive_shadow=False,
            )

        for part in chain.parts:
            add(part.frame, part.name, capsule(part.start, part.end, part.radius), body)
        for joint, radius in self._caps():
            add(2 * joint, f"cap_{joint}", cap(radius), caps)
        if payload.mass > 0.0 and any(payload.com):
            held = capsule(np.zeros(3), 2.0 * np.array(payload.com), payload_radius)
            add(2 * chain.joints, "payload", held, GHOST if ghost else LOAD)

    def move(self, q: Floats, bends: Floats) -> Floats:
        """Put it at joint angles with link deflections [rad]; the flange's position in the scene, shape (3,) [m]."""
        poses = self._chain.frames(q, bends)
        for handle, pose in zip(self._frames, poses, strict=True):
            handle.position = pose[:3, 3]
            handle.wxyz = quaternion(pose[:3, :3])
        return np.asarray(poses[-1][:3, 3] + self.at)

    def show(self, *, visible: bool) -> None:
        """Show or hide it."""
        self.root.visible = visible

    def _caps(self) -> list[tuple[int, float]]:
        """Joints and the radii of their caps, which stand out of the thicker part beside them."""
        radius_of: dict[int, float] = {}
        for part in self._chain.parts:
            link = -1 if part.frame == 0 else (part.frame - 1) // 2
            radius_of[link] = max(radius_of.get(link, 0.0), part.radius)
        found = []
        for joint in range(self._chain.joints):
            sides = [radius_of[link] for link in (joint - 1, joint) if link in radius_of]
            if sides:
                found.append((joint, CAP_SHARE * max(sides)))
        return found


def capsule(start: Floats, end: Floats, radius: float) -> trimesh.Trimesh:
    """Mesh of a capsule between two points [m]."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    mesh: trimesh.Trimesh = trimesh.creation.capsule(height=length, radius=radius, count=(16, 24))
    placed = np.eye(4)
    if length > 0.0:
        z = axis / length
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        x /= np.linalg.norm(x)
        placed[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    placed[:3, 3] = start
    mesh.apply_translation([0.0, 0.0, (length - mesh.bounds[:, 2].sum()) / 2.0])
    mesh.apply_transform(placed)
    return mesh


def cap(radius: float) -> trimesh.Trimesh:
    """Mesh of a joint: a flat cylinder about its axis."""
    mesh: trimesh.Trimesh = trimesh.creation.cylinder(radius=radius, height=0.8 * radius, sections=32)
    return mesh


def quaternion(rotation: Floats) -> tuple[float, float, float, float]:
    """Rotation matrix as w x y z."""
    trace = float(np.trace(rotation))
    if trace > 0.0:
        w = np.sqrt(1.0 + trace) / 2.0
        x, y, z = (
            (rotation[2, 1] - rotation[1, 2]) / (4 * w),
            (rotation[0, 2] - rotation[2, 0]) / (4 * w),
            (rotation[1, 0] - rotation[0, 1]) / (4 * w),
        )
        return float(w), float(x), float(y), float(z)
    i = int(np.argmax(np.diag(rotation)))
    j, k = (i + 1) % 3, (i + 2) % 3
    root = np.sqrt(1.0 + rotation[i, i] - rotation[j, j] - rotation[k, k])
    out = [0.0, 0.0, 0.0]
    out[i] = root / 2.0
    out[j] = (rotation[j, i] + rotation[i, j]) / (2.0 * root)
    out[k] = (rotation[k, i] + rotation[i, k]) / (2.0 * root)
    return float((rotation[k, j] - rotation[j, k]) / (2.0 * root)), *map(float, out)  # type: ignore[return-value]
