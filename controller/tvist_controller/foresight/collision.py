"""Collisions of the arm with itself and the floor, using the robot file's capsules."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin

from tvist_controller.foresight.clearance import (
    ARMS,
    BODY,
    FIRST,
    FLOOR,
    LINK,
    ONE,
    OTHER,
    RADIUS,
    rooms,
    stop_has_room,
)
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.trajectory import CheckedMotion
from tvist_plant.chain import AXES, chain_of
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, link_frame, rigid_model

CLEARANCE = 0.005
"""Smallest permitted distance between two bodies [m]."""
FAR_APART = 0.05  # distance above which long steps between checks are allowed [m]
SHORT = 0.004  # travel of the arm between two checks at the smallest permitted distance [m]
ROUNDING = 1e-9  # distance changes below this are rounding errors [m]
BOUND_MARGIN = 1e-5  # margin of bounds beyond the clearance, above the accuracy of distances [m]
PAYLOAD = "payload"


@dataclass(frozen=True)
class CloseBodies:
    """A pair of bodies that are too close."""

    first: str
    second: str
    distance: float  # distance between their surfaces; negative if they overlap [m]

    def __str__(self) -> str:
        pair, distance = f"{self.first} and {self.second}", 1e3 * self.distance
        if distance < 0.0:
            return f"{pair} would overlap by {-distance:.1f} mm"
        return f"{pair} would be {distance:.1f} mm apart"


class CollisionModel:
    """The arm's bodies, its declared payload and the floor; without bodies there are no collisions."""

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        model, collision = rigid_model(description, Payload()), description.collision
        frame = model.frames[model.getFrameId(FLANGE)]
        self._chain = chain_of(model, model.getFrameId(FLANGE))
        self._links = [float(np.linalg.norm(one.translation)) for one in model.jointPlacements]
        # From pinocchio's frame of each link to that of its chain, whose z is the axis.
        self._axes = [np.eye(3), *(AXES[joint.shortname()] for joint in list(model.joints)[1:])]
        self._flange, self._payload_radius = frame.placement, collision.payload_radius
        self._flange_link = frame.parentJoint
        self._names = [body.name for body in collision.bodies]
        self._names += [PAYLOAD] if self._names else []
        self._names += ["floor"] if self._names and collision.has_floor else []
        self._bodies = np.zeros((len(self._names), BODY))
        self._far = np.full((len(self._names), description.joints), np.inf)
        """Bound of each body's travel per joint [m/rad]."""
        for number, body in enumerate(collision.bodies):
            place = pin.SE3.Identity() if body.link < 0 else link_frame(description, body.link)
            ends = np.array([place.act(np.array(end)) for end in (body.start, body.end)])
            self._put(number, max(body.link + 1, 0), ends, body.radius)
        if self._names and collision.has_floor:
            self._bodies[-1, [LINK, RADIUS]] = FLOOR, collision.floor
        self._all_pairs = self._pairs_of(description)
        self._still = np.zeros(description.joints)
        self._upright = bool(np.allclose(self._chain[0, [2, 5]], 0.0))
        """Whether the first axis is vertical, so that turning it changes no heights."""
        self.declare(payload)

    def meeting(self, q: Floats) -> CloseBodies | None:
        """Return the closest pair of bodies at a posture if closer than `CLEARANCE`, else None."""
        gaps = self._gaps(q)
        number = int(np.argmin(gaps)) if len(gaps) else None
        return None if number is None or gaps[number] >= CLEARANCE else self._meeting_of(gaps, number)

    def misplaced(self, q: Floats, *payloads: Payload) -> str | None:
        """Return a message if bodies are too close at a posture with any of these payloads, else None."""
        before = self.declared
        for payload in payloads:
            self.declare(payload)
            met = self.meeting(q)
            self.declare(before)
            if met is not None:
                posture = ", ".join(f"{angle:.4g}" for angle in q)
                return f"at q = [{posture}] {met}, and at least {1e3 * CLEARANCE:g} mm are required"
        return None

    def on_way(self, way: CheckedMotion, *, before: Floats | None = None) -> tuple[float, CloseBodies] | None:
        """Return where bodies first come too close on a path (share of it), and these bodies; else None.

        Steps are long where all bodies are far apart. If a pair is too close at the start, or at the posture
        `before` the path, it may separate but not come closer.
        """
        travel, share = float(np.abs(way.turned) @ self._reach), 0.0  # at most, of any point [m]
        least = np.minimum(self._gaps(way.at(0.0) if before is None else before), CLEARANCE)
        while True:
            gaps = self._gaps(way.at(share))
            if (gaps < least - ROUNDING).any():
                return share, self._meeting_of(gaps, int(np.argmin(gaps - least)))
            least = np.maximum(np.minimum(gaps, CLEARANCE), least)
            if share >= 1.0:
                return None
            nearest = min(float(gaps.min(initial=np.inf)), FAR_APART)
            share = 1.0 if travel <= 0.0 else min(share + max(nearest - CLEARANCE, SHORT) / travel, 1.0)

    def is_spacious(self, q: Floats, turned: Floats) -> bool:
        """Return whether bodies certainly stay apart while joints turn by up to these angles from q."""
        return rooms(*self._parts, q, turned, self._found) > CLEARANCE + BOUND_MARGIN

    def stop_is_spacious(self, state: Target, acceleration: float, jerk: float) -> bool:
        """Return whether bodies certainly stay apart during a joint stop within these limits."""
        least = CLEARANCE + BOUND_MARGIN
        return stop_has_room(*self._parts, state.q, state.qd, state.qdd, acceleration, jerk, least)

    def declare(self, payload: Payload) -> None:
        """Change the payload in place."""
        self.declared = payload
        pairs, carried = self._all_pairs, self._bodies[:, [LINK]] > np.arange(len(self._still))
        if self._names:
            number, centre = self._names.index(PAYLOAD), np.array(payload.com)
            distance = float(np.linalg.norm(centre))
            inset = centre * min(self._payload_radius / distance, 1.0) if distance > 0.0 else centre
            ends = np.array([self._flange.act(end) for end in (inset, 2.0 * centre - inset)])
            self._put(number, self._flange_link, ends, self._payload_radius)
            carried[number] = payload.mass > 0.0 and self._flange_link > np.arange(len(self._still))
            pairs = pairs if payload.mass > 0.0 else pairs[(pairs[:, [ONE, OTHER]] != number).all(axis=1)]
        pairs = np.array([self._bounded(pair) for pair in pairs]).reshape(-1, ARMS + len(self._still))
        self._parts = self._chain, self._bodies, pairs, np.zeros((len(self._names), 6))
        """Chain, bodies, pairs that can meet, and scratch: arguments of the kernels in `clearance`."""
        self._found = np.zeros(len(pairs))
        self._reach = np.where(carried, self._far, 0.0).max(axis=0, initial=0.0)
        """Largest distance of the arm from each joint's axis in any posture, shape (n,) [m]."""

    def _gaps(self, q: Floats) -> Floats:
        found = np.empty(len(self._found))
        rooms(*self._parts, q, self._still, found)
        return found

    def _meeting_of(self, gaps: Floats, number: int) -> CloseBodies:
        pair = self._parts[2][number]
        return CloseBodies(self._names[int(pair[ONE])], self._names[int(pair[OTHER])], float(gaps[number]))

    def _put(self, number: int, link: int, ends: Floats, radius: float) -> None:
        """Place a body by the ends of its axis in its link's pinocchio frame, shape (2, 3) [m]."""
        row = self._bodies[number]
        row[LINK], row[FIRST:RADIUS], row[RADIUS] = link, (ends @ self._axes[link]).ravel(), radius
        own = radius + float(np.linalg.norm(ends, axis=1).max())
        along = np.cumsum(self._links)
        self._far[number] = own + np.abs(along[link] - along[1:])

    def _bounded(self, pair: Floats) -> Floats:
        row, (one, other) = pair.copy(), (int(pair[ONE]), int(pair[OTHER]))
        links = [max(int(self._bodies[number, LINK]), 0) for number in (one, other)]
        between = slice(min(links), max(links))
        row[ARMS:][between] = np.minimum(self._far[one], self._far[other])[between]
        if self._upright and self._bodies[other, LINK] == FLOOR:
            row[ARMS] = 0.0
        return row

    def _pairs_of(self, description: RobotDescription) -> Floats:
        """Return the pairs of bodies to check; their columns from `ARMS` on are still zero."""
        bodies = len(description.collision.bodies) + 1 if self._names else 0
        apart = {frozenset(pair) for pair in description.collision.apart}
        found = [
            (first, second)
            for first, second in combinations(range(bodies), 2)
            if second - first > 1 and frozenset((self._names[first], self._names[second])) not in apart
        ]
        if self._names and description.collision.has_floor:
            # The base stands on the floor, and the shoulder cannot reach it.
            found += [(number, bodies) for number in range(2, bodies)]
        pairs = np.zeros((len(found), ARMS + description.joints))
        pairs[:, [ONE, OTHER]] = np.array(found).reshape(-1, 2)
        return pairs
