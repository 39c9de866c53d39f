"""Collisions of the arm with itself and the floor: capsules of the robot file, distances by coal."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import coal
import numpy as np
import pinocchio as pin

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.foresight.clearance import (
    ARMS,
    BODY,
    FIRST,
    FLOOR,
    LINK,
    RADIUS,
    has_room,
    stop_has_room,
)
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.trajectory import Way
from tvist_plant.chain import AXES, chain_of
from tvist_plant.description import Body, Payload, RobotDescription
from tvist_plant.model import FLANGE, link_frame, rigid_model

CLEARANCE = 0.005
"""Smallest permitted distance between two bodies [m]."""
FAR = 0.05
"""Distance above which checks may be far apart [m]."""
SHORT = 0.004
"""Travel of the arm's points between two checks where bodies are as close as permitted [m]."""
ROUNDING = 1e-9
"""Changes of a distance below this are rounding errors [m]."""
SURE = 1e-5
"""What a bound must leave beyond the clearance, more than the accuracy of distances [m]."""
PAYLOAD = "payload"


@dataclass(frozen=True)
class Meeting:
    """Two bodies that are too close to each other."""

    first: str
    second: str
    distance: float
    """Distance between their surfaces; negative if they overlap [m]."""

    def __str__(self) -> str:
        pair, distance = f"{self.first} and {self.second}", 1e3 * self.distance
        if distance < 0.0:
            return f"{pair} would overlap by {-distance:.1f} mm"
        return f"{pair} would be {distance:.1f} mm apart"


class CollisionModel:
    """The arm's bodies, its declared payload and the floor, if there is one.

    Args:
        description: The robot; if it has no bodies, there are no collisions.
        payload: Declared payload.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._model = rigid_model(description, Payload())
        self._data = self._model.createData()
        self._chain = chain_of(self._model, self._model.getFrameId(FLANGE))
        self._reach = np.zeros(description.joints)
        self.declared = payload
        """Declared payload."""
        self._geometry = pin.GeometryModel()
        self._names: list[str] = []
        collision = description.collision
        for body in collision.bodies:
            self._add(body, description)
        if collision.bodies:
            self._add_payload(collision.payload_radius)
        self._add_pairs(description)
        self._fine, self._coarse = (self._request(margin) for margin in (CLEARANCE, FAR))
        self._distances = self._geometry.createData()
        self._pairs = list(self._geometry.collisionPairs)
        self._bodies = np.zeros((len(self._names), BODY))
        self._far = np.full((len(self._names), description.joints), np.inf)
        for number in range(len(self._names)):
            self._bound(number)
        self._with_payload = np.array(
            [PAYLOAD in (self._names[pair.first], self._names[pair.second]) for pair in self._pairs],
            dtype=bool,
        )
        self._loaded = False
        self._bounds = self._bound_pairs()
        self.declare(payload)

    def meeting(self, q: Floats) -> Meeting | None:
        """Return the nearest pair of bodies at a posture, if it is closer than the clearance.

        Args:
            q: Joint positions, shape (n,) [rad].
        """
        return self._nearest(q) if self._within(self._fine, q) else None

    def misplaced(self, q: Floats, *payloads: Payload) -> str | None:
        """Say which bodies would meet if the arm were put at a posture with one of these payloads; None if none would.

        Args:
            q: Joint positions, shape (n,) [rad].
            payloads: The declared payload, and others that the arm might carry there.
        """
        before = self.declared
        for payload in payloads:
            self.declare(payload)
            met = self.meeting(q)
            self.declare(before)
            if met is not None:
                posture = ", ".join(f"{angle:.4g}" for angle in q)
                return f"at q = [{posture}] {met}, and at least {1e3 * CLEARANCE:g} mm are required"
        return None

    def check_place(self, q: Floats, payloads: Sequence[Payload], field: str) -> None:
        """Refuse to put the arm, or another payload on it, where two bodies would be nearer than permitted.

        Args:
            q: Joint positions, shape (n,) [rad].
            payloads: See `misplaced`.
            field: Field of the command that is to blame.

        Raises:
            RefusalError: They would be.
        """
        met = self.misplaced(q, *payloads)
        if met is not None:
            why = f"{met}: choose a posture in which the arm and its payload are clear"
            raise RefusalError("collision", field, why, CLEARANCE)

    def on_way(self, way: Way, *, before: Floats | None = None) -> tuple[float, Meeting] | None:
        """Find the first meeting on a way, in long steps where everything is far apart and short ones elsewhere.

        Args:
            way: Joint positions along the path, as `Path.whole` and `Path.way` return them.
            before: Posture from which the way begins, shape (n,) [rad]. Bodies that are too close there may move apart,
                but none of these pairs may come closer again. None: the beginning of the way itself.

        Returns:
            Share of the way, and the pair; None if the way is clear.
        """
        travel, share = self.travel(way.turned), 0.0
        begin = way.at(0.0) if before is None else before
        least = np.minimum(self._gaps(begin), CLEARANCE) if self._within(self._fine, begin) else CLEARANCE
        while True:
            q = way.at(share)
            step = FAR - CLEARANCE
            if self._within(self._coarse, q):
                gaps = self._gaps(q)
                if (gaps < least - ROUNDING).any():
                    return share, self._meeting_of(gaps, int(np.argmin(gaps - least)))
                least = np.maximum(np.minimum(gaps, CLEARANCE), least)
                step = max(float(gaps.min()) - CLEARANCE, SHORT)
            else:
                least = CLEARANCE
            if share >= 1.0:
                return None
            share = 1.0 if travel <= 0.0 else min(share + step / travel, 1.0)

    def nearest(self, postures: Floats, far: float = FAR) -> float:
        """Smallest distance between two bodies at k postures, shape (k, n) [rad]; `far` if none is smaller [m]."""
        near = [q for q in postures if self._names and self._within(self._coarse, q)]
        return min((far, *(self._nearest(q).distance for q in near)))

    def travel(self, turned: Floats) -> float:
        """Upper bound of any point's travel [m] while the joints turn by these angles, shape (n,) [rad]."""
        return float(np.abs(turned) @ self._reach)

    def is_spacious(self, q: Floats, turned: Floats) -> bool:
        """Return whether the joints can certainly turn by some angles without a meeting.

        Args:
            q: Joint positions around which they turn, shape (n,) [rad].
            turned: Largest angle of each joint, shape (n,) [rad].
        """
        return has_room(*self._bounds, q, turned, CLEARANCE + SURE)

    def stop_is_spacious(self, state: Target, acceleration: float, jerk: float) -> bool:
        """Return whether the joints can certainly stop without a meeting.

        Args:
            state: State of motion at the start.
            acceleration: Acceleration limit [rad/s^2].
            jerk: Jerk limit [rad/s^3].
        """
        least = CLEARANCE + SURE
        return stop_has_room(*self._bounds, state.q, state.qd, state.qdd, acceleration, jerk, least)

    def _request(self, margin: float) -> pin.GeometryData:
        data = self._geometry.createData()
        for request in data.collisionRequests:
            request.security_margin = margin
        return data

    def _within(self, margin: pin.GeometryData, q: Floats) -> bool:
        """Return whether any pair is closer than the margin."""
        return bool(pin.computeCollisions(self._model, self._data, self._geometry, margin, q, True))

    def _nearest(self, q: Floats) -> Meeting:
        gaps = self._gaps(q)
        return self._meeting_of(gaps, int(np.argmin(gaps)))

    def _gaps(self, q: Floats) -> Floats:
        """Distance of each pair of bodies at a posture [m]."""
        pin.computeDistances(self._model, self._data, self._geometry, self._distances, q)
        gaps = np.array([result.min_distance for result in self._distances.distanceResults])
        if not self._loaded:
            gaps[self._with_payload] = np.inf
        return gaps

    def _meeting_of(self, gaps: Floats, number: int) -> Meeting:
        pair = self._pairs[number]
        return Meeting(self._names[pair.first], self._names[pair.second], float(gaps[number]))

    def _add(self, body: Body, description: RobotDescription) -> None:
        start, end = np.array(body.start), np.array(body.end)
        if body.link < 0:
            self._add_capsule(body.name, 0, pin.SE3.Identity(), start, end, body.radius)
        else:
            frame = link_frame(description, body.link)
            self._add_capsule(body.name, body.link + 1, frame, start, end, body.radius)

    def _add_payload(self, radius: float) -> None:
        flange = self._model.frames[self._model.getFrameId(FLANGE)]
        self._flange, self._radius, self._payload = flange.placement, radius, len(self._names)
        nowhere = np.zeros(3)
        self._add_capsule(PAYLOAD, flange.parentJoint, flange.placement, nowhere, nowhere, radius)

    def declare(self, payload: Payload) -> None:
        """Change the payload in place, since building a new model takes a good part of a tick.

        Args:
            payload: Declared payload.
        """
        self.declared = payload
        if not self._names:
            return
        centre = np.array(payload.com)
        distance = float(np.linalg.norm(centre))
        inset = centre * min(self._radius / distance, 1.0) if distance > 0.0 else centre
        body = self._geometry.geometryObjects[self._payload]
        body.placement, length = _placed(self._flange, inset, 2.0 * centre - inset)
        body.geometry.halfLength = length / 2.0
        self._loaded = payload.mass > 0.0
        body.disableCollision = not self._loaded
        self._reach = self._reaches()
        self._bound(self._payload)
        self._bounds = self._bound_pairs()

    def _reaches(self) -> Floats:
        """Largest distance of any point of the arm from each joint's axis, in any posture, shape (n,) [m]."""
        joints = self._model.nv
        own = np.zeros(joints)  # from the joint's origin to the farthest point of its own link
        for body in self._geometry.geometryObjects:
            if body.parentJoint > 0 and not body.disableCollision:
                axis = body.placement.rotation[:, 2] * body.geometry.halfLength
                ends = [np.linalg.norm(body.placement.translation + sign * axis) for sign in (-1.0, 1.0)]
                joint = body.parentJoint - 1
                own[joint] = max(own[joint], max(ends) + body.geometry.radius)
        links = [float(np.linalg.norm(placement.translation)) for placement in self._model.jointPlacements]
        reach, beyond = np.zeros(joints), 0.0
        for joint in reversed(range(joints)):
            reach[joint] = beyond = max(own[joint], beyond)
            beyond += links[joint + 1]
        return reach

    def _bound(self, number: int) -> None:
        """Tell the bounds of `clearance` where a body is, and how far each joint may carry it [m/rad]."""
        body, row = self._geometry.geometryObjects[number], self._bodies[number]
        if isinstance(body.geometry, coal.Halfspace):
            row[[LINK, RADIUS]] = FLOOR, body.geometry.d
            return
        link, radius = body.parentJoint, body.geometry.radius
        # From pinocchio's frame of the link to that of its chain, whose z is the axis.
        turned = AXES[self._model.joints[link].shortname()] if link > 0 else np.eye(3)
        axis = body.placement.rotation[:, 2] * body.geometry.halfLength
        ends = np.array([body.placement.translation - axis, body.placement.translation + axis])
        row[LINK], row[FIRST:RADIUS], row[RADIUS] = link, (ends @ turned).ravel(), radius
        own = radius + float(np.linalg.norm(ends, axis=1).max())
        along = np.cumsum(
            [np.linalg.norm(placement.translation) for placement in self._model.jointPlacements]
        )
        self._far[number] = own + np.abs(along[link] - along[1:])

    def _bound_pairs(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Chain, bodies, pairs that can meet, and scratch, as the bounds of `clearance` take them."""
        joints = self._model.nv
        pairs = np.zeros((len(self._pairs), ARMS + joints))
        upright = bool(np.allclose(self._chain[0, [2, 5]], 0.0))  # the first joint changes no height
        for row, pair in zip(pairs, self._pairs, strict=True):
            one, other = pair.first, pair.second
            links = [max(int(self._bodies[number, LINK]), 0) for number in (one, other)]
            between = slice(min(links), max(links))
            row[:ARMS] = one, other
            row[ARMS:][between] = np.minimum(self._far[one], self._far[other])[between]
            if upright and self._bodies[other, LINK] == FLOOR:
                row[ARMS] = 0.0
        if not self._loaded:
            pairs = pairs[~self._with_payload]
        return self._chain, self._bodies, pairs, np.zeros((len(self._names), 6))

    def _add_capsule(
        self, name: str, joint: int, frame: pin.SE3, start: Floats, end: Floats, radius: float
    ) -> None:
        placement, length = _placed(frame, start, end)
        shape = coal.Capsule(radius, length)
        self._geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, shape))
        self._names.append(name)

    def _add_pairs(self, description: RobotDescription) -> None:
        collision = description.collision
        apart = {frozenset(pair) for pair in collision.apart}
        bodies = range(len(self._names))
        for first, second in combinations(bodies, 2):
            names = frozenset((self._names[first], self._names[second]))
            if second - first > 1 and names not in apart:
                self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        if not self._names or not collision.has_floor:
            return
        floor = coal.Halfspace(np.array([0.0, 0.0, 1.0]), collision.floor)
        self._geometry.addGeometryObject(pin.GeometryObject("floor", 0, pin.SE3.Identity(), floor))
        self._names.append("floor")
        for number in bodies[2:]:  # the base stands on the floor, and the shoulder cannot reach it
            self._geometry.addCollisionPair(pin.CollisionPair(number, len(self._names) - 1))


def _placed(frame: pin.SE3, start: Floats, end: Floats) -> tuple[pin.SE3, float]:
    """Placement of a capsule and the length of its axis [m], from the ends of the axis in a frame."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    up = np.array([0.0, 0.0, 1.0])
    rotation = pin.Quaternion.FromTwoVectors(up, axis / length).matrix() if length > 0.0 else np.eye(3)
    return frame * pin.SE3(rotation, (start + end) / 2.0), max(length, 1e-6)
