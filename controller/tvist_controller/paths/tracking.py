"""The joints' motion along a tool path: inverse kinematics from knot to knot."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import ACCURATE, Placement, turn
from tvist_controller.paths.tool_curves import ToolCurve, ToolState
from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.spline import Knots, hermite
from tvist_plant.description import RobotDescription

SPACING = 0.03  # largest distance between knots [m]
SHORT = 0.003  # length below which a path needs no inner knots [m]
CLOSEST = 1e-5  # smallest distance between knots; a path that needs closer ones passes a singular posture [m]
TOLERANCE = 1e-6  # largest tool error between two knots [m, rad]
REFRESHED = 3  # number of Jacobian updates in Newton's method per knot
FARTHEST = 1.0  # joint angle beyond which a solution counts as another posture [rad]
STEEPEST = 300.0  # joint turn per metre of path above which the arm is close to a singular posture [rad/m]


class TrackingError(Exception):
    """The joints cannot follow the path."""

    def __init__(self, s: float, pose: Placement, q: Floats) -> None:
        super().__init__(f"no way on from {s:g} m")
        self.s = s  # length at which tracking ends [m]
        self.pose = pose  # pose that cannot be reached
        self.q = q  # joint positions near that pose, shape (n,) [rad]


class Tracker:
    """Kinematics of an arm with a tool; see `Arm` for the TCP."""

    def __init__(self, description: RobotDescription, tcp: Sequence[float]) -> None:
        self._tool = Arm(description, tcp)

    def pose(self, q: Floats) -> Placement:
        """Return the pose of the tool at joint positions, shape (n,) [rad]."""
        return Placement(*self._tool.pose(q))

    def solve(self, goal: Placement, q: Floats) -> Floats | None:
        """Return joint positions near q with a tool pose, shape (n,) [rad]; None if Newton finds none."""
        found = q
        for _ in range(REFRESHED):
            found, error = self._tool.near(goal, found)
            if not np.abs(found - q).max() <= FARTHEST:
                return None
            if np.abs(error).max() <= ACCURATE:
                return found
        return None

    def rates(self, q: Floats, state: ToolState) -> tuple[Floats, Floats] | None:
        """Return dq/ds and d²q/ds² of a posture on a path, each (n,); None at a singularity."""
        jacobian = self._tool.jacobian(q)
        first = _solved(jacobian, state.first)
        if first is None or np.abs(first).max() > STEEPEST:
            return None
        second = _solved(jacobian, state.second - self._tool.acceleration(q, first, np.zeros(len(q))))
        return None if second is None else (first, second)

    def follow(self, curve: ToolCurve, q: Floats) -> Knots:
        """Return the joints' motion along a tool path; raise TrackingError if singular or out of reach."""
        pieces = 1 if curve.length < SHORT else max(int(np.ceil(curve.length / SPACING)), 2)
        knots, step = [self._knot(curve, 0.0, q)], curve.length / pieces
        # One by one, so that a long path out of reach fails after few knots.
        for piece in range(1, pieces + 1):
            knots += self._between(curve, knots[-1], curve.length if piece == pieces else piece * step)
        s, *rest = zip(*knots, strict=True)
        return Knots(np.array(s), *(np.array(values) for values in rest))

    def _between(self, curve: ToolCurve, start: "Knot", end: float) -> list["Knot"]:
        """Return knots up to `end`, so dense that polynomials between them stay near the path."""
        length = end - start[0]
        guess = start[1] + length * (start[2] + 0.5 * length * start[3])
        middle = 0.5 * (start[0] + end)
        try:
            last = self._knot(curve, end, guess)
            c = hermite(length, start[1:], last[1:])
            goal, found = curve.at(middle).pose, self.pose((0.5 * length) ** np.arange(6) @ c)
            off = max(
                float(np.abs(goal.position - found.position).max()),
                float(np.abs(turn(found.rotation, goal.rotation)).max()),
            )
            if off <= TOLERANCE:
                return [last]
        except TrackingError:
            if length < CLOSEST:
                raise
        if length < CLOSEST:
            raise TrackingError(middle, curve.at(middle).pose, start[1])
        first = self._between(curve, start, middle)
        return first + self._between(curve, first[-1], end)

    def _knot(self, curve: ToolCurve, s: float, guess: Floats) -> "Knot":
        state = curve.at(s)
        q = self.solve(state.pose, guess)
        rates = None if q is None else self.rates(q, state)
        if q is None or rates is None:
            raise TrackingError(s, state.pose, guess)
        return s, q, *rates


Knot = tuple[float, Floats, Floats, Floats]  # place, joint positions, and their first two derivatives


def _solved(jacobian: Floats, wanted: Floats) -> Floats | None:
    """Solve J x = wanted; in the least-squares sense unless the arm has six joints."""
    if jacobian.shape[1] == 6:
        try:
            exact: Floats = np.asarray(np.linalg.solve(jacobian, wanted), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        return exact
    return np.asarray(np.linalg.lstsq(jacobian, wanted, rcond=1e-9)[0], dtype=np.float64)
