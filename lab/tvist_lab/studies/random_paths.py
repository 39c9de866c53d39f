"""Random paths of the tool: lines, arcs and chains of lines with blends, from postures away from the singular ones."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tvist_controller.api.line import CollisionModel, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.studies.tool_path import jacobian
from tvist_lab.study.measures import kinematics
from tvist_lab.workspace import ranges, workspace
from tvist_plant.description import RobotDescription
from tvist_protocol.motions import ArcSegment, LineSegment, MovePath, Segment
from tvist_protocol.values import Pose

Kind = Literal["line", "arc", "blends"]
KINDS: tuple[Kind, ...] = ("line", "arc", "blends")
"""Kinds of paths, in the order in which they take turns."""
SPEED, ACCELERATION = (0.1, 1.0), (0.5, 3.0)
"""Ranges of the tool's speed [m/s] and acceleration [m/s²]."""
LENGTH, TURN = (0.1, 0.6), 0.6
"""Range of the length of a line [m], and the largest turn of the tool on a line or an arc [rad]."""
RADIUS, ANGLE = (0.05, 0.25), (np.pi / 3.0, 1.5 * np.pi)
"""Ranges of the radius [m] and angle [rad] of an arc."""
LINES, PART, PART_TURN, BLEND = (3, 5), (0.1, 0.3), 0.3, (0.01, 0.05)
"""Ranges of the number of lines of a chain and of their lengths [m], largest turn [rad], range of the blends [m]."""
REGULAR = 0.05
"""Smallest singular value of the Jacobian at the start, with turns counted as lengths [m]."""
WRIST = np.pi
"""Largest angle of the wrist's two outer joints at the start [rad]."""


@dataclass(frozen=True)
class ToolMove:
    """A path of the tool, and the posture at which it begins."""

    kind: Kind
    start: tuple[float, ...]
    """Joint angles at the start [rad]."""
    mass: float
    """Mass of the payload [kg]."""
    command: MovePath
    """The path, without a token."""


class _Pace(NamedTuple):
    """Speed [m/s] and acceleration [m/s²] of the tool on a path."""

    velocity: float
    acceleration: float


class PathDraw:
    """Draws paths for one robot and one payload.

    Args:
        description: The robot, with six joints or more.
        mass: Mass of the payload [kg].
    """

    def __init__(self, description: RobotDescription, mass: float) -> None:
        self._description, self._mass = description, mass
        self._at = kinematics(description)
        self._collisions = CollisionModel(description, body(paper_payload(description, mass)))

    def draw(self, kind: Kind, random: np.random.Generator) -> ToolMove:
        """Draw a path; whether the robot can follow it is for its planner to say."""
        start = self._posture(random)
        position, matrix = self._at(start)
        pace = _Pace(float(random.uniform(*SPEED)), float(random.uniform(*ACCELERATION)))
        make = {"line": _line, "arc": _arc, "blends": _chain}[kind]
        segments = make(random, position, Rotation.from_matrix(matrix), pace)
        return ToolMove(kind, tuple(start.tolist()), self._mass, MovePath(token="", segments=segments))

    def _posture(self, random: np.random.Generator) -> Floats:
        """A posture of the workspace that is free of collisions and not singular."""
        n = self._description.joints
        region = workspace(ranges(self._description))
        while True:
            q = random.uniform(-WRIST, WRIST, n)
            used = len(region.low)
            q[:used] = random.uniform(region.low, region.high)
            values = np.linalg.svd(jacobian(self._at, q), compute_uv=False)
            if values[-1] >= REGULAR and self._collisions.meeting(q) is None:
                return q


def _line(
    random: np.random.Generator, position: Floats, rotation: Rotation, pace: _Pace
) -> tuple[Segment, ...]:
    pose = pose_of(position + random.uniform(*LENGTH) * _direction(random), _turned(random, rotation, TURN))
    return (LineSegment(pose=pose, velocity=pace.velocity, acceleration=pace.acceleration),)


def _arc(
    random: np.random.Generator, position: Floats, rotation: Rotation, pace: _Pace
) -> tuple[Segment, ...]:
    axis, aside = _direction(random), _direction(random)
    out = np.cross(axis, aside)
    out *= random.uniform(*RADIUS) / np.linalg.norm(out)
    angle = random.uniform(*ANGLE)
    via, end = (
        position - out + Rotation.from_rotvec(share * angle * axis).apply(out) for share in (0.5, 1.0)
    )
    turned = _turned(random, rotation, TURN)
    return (
        ArcSegment(
            via=pose_of(via, rotation),
            pose=pose_of(end, turned),
            velocity=pace.velocity,
            acceleration=pace.acceleration,
        ),
    )


def _chain(
    random: np.random.Generator, position: Floats, rotation: Rotation, pace: _Pace
) -> tuple[Segment, ...]:
    segments = []
    for _ in range(int(random.integers(LINES[0], LINES[1] + 1))):
        position = position + random.uniform(*PART) * _direction(random)
        rotation = _turned(random, rotation, PART_TURN)
        segments.append(
            LineSegment(
                pose=pose_of(position, rotation),
                blend=float(random.uniform(*BLEND)),
                velocity=pace.velocity,
                acceleration=pace.acceleration,
            )
        )
    return tuple(segments)


def _direction(random: np.random.Generator) -> Floats:
    """A direction, uniformly distributed, shape (3,)."""
    found = random.normal(size=3)
    direction: Floats = found / np.linalg.norm(found)
    return direction


def _turned(random: np.random.Generator, rotation: Rotation, most: float) -> Rotation:
    return Rotation.from_rotvec(random.uniform(0.0, most) * _direction(random)) * rotation


def pose_of(position: Floats, rotation: Rotation) -> Pose:
    """Return a pose as messages have it: position [m] and rotation vector [rad]."""
    x, y, z = map(float, position)
    a, b, c = map(float, rotation.as_rotvec())
    return (x, y, z, a, b, c)
