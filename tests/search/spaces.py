"""Random motions of the tool, and where the tool has to be, computed from the commands alone with scipy's rotations."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation, Slerp
from tests.search.subject import Subject

from tvist_controller.setup import paper_payload
from tvist_plant.description import Payload, load
from tvist_plant.model import FLANGE, rigid_model
from tvist_protocol.io import SetTcp
from tvist_protocol.motions import ArcSegment, LineSegment, ProcessSegment

UR5E = load("ur5e")
BENT = np.array([0.2, -1.4, 1.7, -1.8, -1.5, 0.3])  # a posture far from any singular one [rad]
NO_TOOL = (0.0,) * 6
TOOL = (0.02, -0.03, 0.12, 0.4, -0.2, 0.9)  # a tool centre point, in the flange frame [m, rad]
_MODEL = rigid_model(UR5E, Payload())
_DATA = _MODEL.createData()
_FLANGE = _MODEL.getFrameId(FLANGE)


def tool_pose(q, tcp=TOOL) -> tuple[np.ndarray, Rotation]:
    """Position and orientation of the tool, by pinocchio."""
    pin.framesForwardKinematics(_MODEL, _DATA, np.asarray(q))
    flange = _DATA.oMf[_FLANGE]
    turned = Rotation.from_matrix(flange.rotation)
    return flange.translation + turned.apply(tcp[:3]), turned * Rotation.from_rotvec(tcp[3:])


def pose_of(position, rotation: Rotation) -> tuple[float, ...]:
    return (*map(float, position), *map(float, rotation.as_rotvec()))


def start_posture(random) -> np.ndarray:
    """A posture away from the singular ones, with the tool above the floor."""
    while True:
        q = np.array([0.0, -1.5, 1.7, -1.7, -1.5, 0.3]) + random.uniform(-0.5, 0.5, 6)
        q[0] = random.uniform(-3.0, 3.0)
        if tool_pose(q)[0][2] > 0.2:
            return q


@dataclass
class Leg:
    """What one segment of a path asks for."""

    kind: str
    start: tuple[np.ndarray, Rotation]
    end: tuple[np.ndarray, Rotation]
    via: np.ndarray | None = None
    tangent: bool = False
    blend: float = 0.0

    def off(self, position, rotation: Rotation) -> tuple[float, float]:
        """How far a pose is from the leg: of its position, and of its orientation from the one of that place."""
        share = self._share(position, rotation)
        at, turned = self._at(share)
        return float(np.linalg.norm(position - at)), float((rotation * turned.inv()).magnitude())

    def _share(self, position, rotation: Rotation) -> float:
        (p, r), (p1, r1) = self.start, self.end
        if self.kind == "arc":
            centre, axis, out, angle = self._circle()
            now = position - centre
            turn = np.arctan2(now @ np.cross(axis, out), now @ out) % (2.0 * np.pi)
            return (turn if turn < angle + 0.5 * (2.0 * np.pi - angle) else turn - 2.0 * np.pi) / angle
        way = p1 - p
        if np.linalg.norm(way) > 1e-4:
            return float((position - p) @ way / (way @ way))
        whole = (r1 * r.inv()).as_rotvec()
        return float((rotation * r.inv()).as_rotvec() @ whole / (whole @ whole))

    def _at(self, share: float) -> tuple[np.ndarray, Rotation]:
        (p, r), (p1, r1) = self.start, self.end
        inside = min(max(share, 0.0), 1.0)
        turned = Slerp([0.0, 1.0], Rotation.concatenate([r, r1]))(inside)
        if self.kind != "arc":
            return p + share * (p1 - p), turned
        centre, axis, out, angle = self._circle()
        swing = Rotation.from_rotvec(share * angle * axis)
        return centre + swing.apply(out), (swing * r if self.tangent else turned)

    def _circle(self):
        """Centre, axis, radius to the start and angle of the circle through three points, by linear equations."""
        p, v, p1 = self.start[0], self.via, self.end[0]
        axis = np.cross(v - p, p1 - p)
        axis /= np.linalg.norm(axis)
        rows = np.array([v - p, p1 - p, axis])
        sides = np.array([(v @ v - p @ p) / 2.0, (p1 @ p1 - p @ p) / 2.0, axis @ p])
        centre = np.linalg.solve(rows, sides)
        out = p - centre

        def angle(point):
            now = point - centre
            return np.arctan2(now @ np.cross(axis, out), now @ out) % (2.0 * np.pi)

        assert angle(v) < angle(p1), "the axis of p, via, end turns from p through via to the end"
        return centre, axis, out, angle(p1)


def random_path(random, q) -> tuple[dict, list[Leg]]:
    """Segments of a random path from a posture, and their legs."""
    segments, legs, start = [], [], tool_pose(q)
    for _ in range(int(random.integers(1, 5))):
        position = start[0] + random.uniform(-0.15, 0.15, 3)
        rotation = Rotation.from_rotvec(random.uniform(-0.5, 0.5, 3)) * start[1]
        pace = {
            "velocity": float(random.uniform(0.05, 1.5)),
            "acceleration": float(random.uniform(0.3, 5.0)),
            "blend": float(random.choice([0.0, 0.01, 0.03, 0.08])),
        }
        kind = str(random.choice(["line", "line", "process", "arc", "tangent", "turn"]))
        via = None
        if kind == "turn":
            position = start[0]
        if kind in {"arc", "tangent"}:
            via = start[0] + random.uniform(-0.08, 0.08, 3)
            tangent = kind == "tangent"
            leg = Leg("arc", start, (position, rotation), via, tangent)
            if tangent:
                leg.end = (position, leg._at(1.0)[1])
            segments.append(
                ArcSegment(
                    via=pose_of(via, rotation),
                    pose=pose_of(position, rotation),
                    orientation="tangent" if tangent else "interpolated",
                    **pace,
                )
            )
        else:
            make = ProcessSegment if kind == "process" else LineSegment
            leg = Leg("line", start, (position, rotation))
            segments.append(make(pose=pose_of(position, rotation), **pace))
        leg.blend = pace["blend"]
        legs.append(leg)
        start = leg.end
    return {"segments": tuple(segments), "jerk": float(random.choice([20.0, 60.0, 400.0]))}, legs


def errors(q, legs: list[Leg], tcp=TOOL) -> tuple[float, float]:
    """Largest distance from the path and from its orientation, outside the blends; inside these nothing is asked.

    References are compared with the legs in their order: each belongs to the leg that it is nearest to, and those
    within a blend's radius of its corner are left out.
    """
    corners = [(leg.end[0], leg.blend) for leg in legs[:-1]]
    worst = np.zeros(2)
    for posture in q:
        position, rotation = tool_pose(posture, tcp)
        if any(np.linalg.norm(position - corner) <= radius * (1.0 + 1e-9) for corner, radius in corners):
            continue
        off = min((leg.off(position, rotation) for leg in legs), key=sum)
        worst = np.maximum(worst, off)
    return float(worst[0]), float(worst[1])


def begun(q=BENT, shaper: str = "none", tcp=NO_TOOL) -> Subject:
    robot = Subject(UR5E, np.array(q), paper_payload(UR5E, 1.0), shaper=shaper)
    robot.send(SetTcp, offset=tcp)
    return robot


def away(dx, turn=(0.0, 0.0, 0.0), q=BENT, tcp=NO_TOOL) -> tuple[float, ...]:
    """The tool's pose at a posture, moved and turned in the base frame."""
    position, rotation = tool_pose(q, tcp)
    return pose_of(position + np.array(dx), Rotation.from_rotvec(turn) * rotation)
