"""What the elements of a URDF file mean: joints, bodies, placements."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from tvist_plant.robot_tables import RobotFileError
from tvist_plant.user_file import LONGEST_NAME, UserFileError, is_name, read_text, xml

Floats = npt.NDArray[np.float64]

TURNING: Final = ("revolute", "continuous")
UPRIGHT: Final = 1e-6
"""Cosine of pitch below which roll and yaw are not unique [-]."""
LARGEST: Final = 1e7
"""Largest number, as in other robot files."""


class UrdfError(RobotFileError):
    """A URDF file describes no arm that can be simulated; the message names the link or joint."""


@dataclass(frozen=True)
class Joint:
    """A joint between two links."""

    name: str
    kind: str
    parent: str
    child: str
    placement: Floats
    """Frame of the child in that of the parent, 4x4."""
    axis: Floats
    limit: Element | None


@dataclass
class Body:
    """Sum of rigid bodies, in one frame."""

    mass: float = 0.0
    moment: Floats = field(default_factory=lambda: np.zeros(3))
    """Mass times centre of mass [kg m]."""
    inertia: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    """Inertia about the frame's origin [kg m²]."""

    def add(self, mass: float, com: Floats, inertia: Floats) -> None:
        """Add a body with its inertia about its own centre of mass."""
        self.mass += mass
        self.moment = self.moment + mass * com
        self.inertia = self.inertia + inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))

    def about_centre(self) -> tuple[Floats, Floats]:
        """Return the centre of mass [m] and the inertia about it [kg m²]."""
        com = self.moment / self.mass
        return com, self.inertia - self.mass * (com @ com * np.eye(3) - np.outer(com, com))


def parsed(path: str | Path, where: str) -> Element:
    """Read the outermost element of a URDF file.

    Raises:
        UrdfError: The file is no URDF.
        UserFileError: The file is not text, too large or nested too deeply.
        OSError: The file cannot be read.
    """
    text = read_text(path, "robot file")
    try:
        root = xml(text.encode())
    except UserFileError as error:
        raise UrdfError(f"{where}: {error}") from error
    if root.tag != "robot":
        raise UrdfError(f"{where}: it is no URDF: its outermost element must be <robot>; expand xacro first")
    return root


def named(element: Element, where: str) -> str:
    """Return the name of an element."""
    name = element.get("name")
    if not name:
        raise UrdfError(f"{where}: a <{element.tag}> has no name")
    if not is_name(name):
        raise UrdfError(
            f"{where}: a <{element.tag}> has the name {name!r:.{LONGEST_NAME}}: "
            f"must be at most {LONGEST_NAME} printable characters"
        )
    return name


def joint_of(element: Element, where: str) -> Joint:
    """Read a joint."""
    name = named(element, where)
    here = f"{where}: joint {name}"
    ends = [
        part.get("link") if (part := element.find(tag)) is not None else None for tag in ("parent", "child")
    ]
    if not ends[0] or not ends[1]:
        raise UrdfError(f"{here} has no parent or no child link")
    axis = element.find("axis")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else numbers(axis, "xyz", (1.0, 0.0, 0.0), here)
    kind = str(element.get("type"))
    if kind in TURNING and not np.linalg.norm(direction) > 0.0:
        raise UrdfError(f"{here}: axis is 0 0 0: must have a direction")
    if kind in TURNING and element.find("mimic") is not None:
        raise UrdfError(f"{here} mimics another joint: only joints of their own are supported")
    return Joint(name, kind, ends[0], ends[1], origin_of(element, here), direction, element.find("limit"))


def numbers(element: Element, key: str, default: tuple[float, ...], here: str) -> Floats:
    """Return the numbers of an attribute, as many as its default has."""
    text = element.get(key)
    try:
        found = np.array(default if text is None else [float(word) for word in text.split()])
    except ValueError:
        found = np.zeros(0)
    if len(found) != len(default) or not (np.abs(found) <= LARGEST).all():
        raise UrdfError(f"{here}: {key} is {text!r:.60}: must be {len(default)} numbers within ±{LARGEST:g}")
    return found


def origin_of(element: Element, here: str) -> Floats:
    """Return the placement of an element in that of its parent, 4x4."""
    origin = element.find("origin")
    placement = np.eye(4)
    if origin is not None:
        placement[:3, :3] = rotation(*numbers(origin, "rpy", (0.0, 0.0, 0.0), here))
        placement[:3, 3] = numbers(origin, "xyz", (0.0, 0.0, 0.0), here)
    return placement


def mesh_file(name: str, urdf: Path) -> Path:
    """Return where a mesh's file is, as far as that can be known without ROS: beside its package's folder.

    Args:
        name: Name in the URDF: `package://PACKAGE/...`, `file://...` or a path from the URDF's folder.
        urdf: The URDF file.
    """
    folder = urdf.resolve().parent
    if not name.startswith("package://"):
        return folder / name.removeprefix("file://")
    inside = Path(name.removeprefix("package://"))
    # A URDF stands somewhere in its package, or in one beside it.
    places = [
        above / part for above in (folder, *folder.parents) for part in (inside, Path(*inside.parts[1:]))
    ]
    return next((place for place in places if place.is_file()), folder / inside)


def rotation(roll: float, pitch: float, yaw: float) -> Floats:
    """Return the rotation matrix of URDF's angles: about fixed x, then y, then z [rad], shape (3, 3)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def angles(matrix: Floats) -> tuple[float, float, float]:
    """Return URDF's angles of a rotation matrix [rad]; where they are not unique, roll is 0."""
    level = math.hypot(matrix[0, 0], matrix[1, 0])
    if level < UPRIGHT:
        return 0.0, math.atan2(-matrix[2, 0], level), math.atan2(-matrix[0, 1], matrix[1, 1])
    return (
        math.atan2(matrix[2, 1], matrix[2, 2]),
        math.atan2(-matrix[2, 0], level),
        math.atan2(matrix[1, 0], matrix[0, 0]),
    )
