"""Planning of trajectories through points at given times: played as they are, or refused."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats, central_differences
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import ROUNDING
from tvist_controller.planning.move_planner import AGILE, MovePlanner, PlannedMove
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.refusal import RefusalError, invalid, missing
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import CheckedMotion, JointLine, PointLaw, TimedMotion, at_least
from tvist_controller.trajectory.points import STANDING
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import MoveTrajectory
from tvist_protocol.replies import Code

NEAR = 0.01  # largest distance of a first point at time 0 from the present reference [rad]
AT_REST = 1e-3  # velocity up to which a trajectory counts as at rest at its ends [rad/s]
GAP = 1e-4  # shortest time between two points [s]
SLACK = 1e-9  # rounding of times [s]
UNSHAPED = ("position", "velocity", "acceleration", "jerk")  # limits that the interpolation keeps
SHAPED = ("position", "velocity", "acceleration", "torque")  # limits that the shaped references keep
_SMOOTHER = "give the points more time, or velocities if they have none"
_REFUSALS: dict[str, tuple[Code, str, str, str]] = {
    "position": ("limit_position", "be at", "rad", "give points whose curve stays in range"),
    "velocity": ("limit_velocity", "have a velocity of", "rad/s", "give the points more time"),
    "acceleration": ("limit_acceleration", "have an acceleration of", "rad/s²", _SMOOTHER),
    "jerk": ("out_of_range", "have a jerk of", "rad/s³", _SMOOTHER),
    "torque": ("limit_torque", "need a torque of", "N m", "give the points more time, or carry less"),
}
"""Code, words, unit and remedy of the refusal by each limit."""


def check_points(command: MoveTrajectory, description: RobotDescription) -> None:
    """Refuse points that make no trajectory of this arm; the refusal names the first."""
    points, least, joints = command.points, 0.0, description.joints
    for number, point in enumerate(points):
        where = f"points[{number}]"
        if point.time < least:
            must = f"at least {1e3 * GAP:g} ms after the point before"
            raise invalid(f"{where}.time", f"{point.time:g} s", must, least)
        least = point.time + GAP
        for name in ("q", "qd", "qdd"):
            values = getattr(point, name)
            if (values is None) != (getattr(points[0], name) is None):
                value = "missing" if values is None else "given"
                raise invalid(f"{where}.{name}", value, "given for all points or for none")
            if values is not None and len(values) != joints:
                must = f"{joints}, one per joint"
                raise invalid(f"{where}.{name}", f"{len(values)} values", must, joints)
        at_end = number == len(points) - 1 or point.time == 0.0
        if point.qd is not None and at_end and max(map(abs, point.qd)) > AT_REST:
            raise invalid(f"{where}.qd", list(point.qd), "0: a trajectory begins and ends at rest", AT_REST)
    if points[0].qd is None and points[0].qdd is not None:
        raise missing("points[0].qd", "accelerations need velocities")
    if points[0].time < GAP and (len(points) == 1 or points[0].time > 0.0):
        must = f"at least {GAP:g} s, or 0 before further points"
        raise invalid("points[0].time", f"{points[0].time:g} s", must, GAP)


class TrajectoryPlanner:
    """Checks trajectories of one robot as a whole."""

    def __init__(self, setup: Setup, filters: FilterPlanner, moves: MovePlanner) -> None:
        self._description, self._filters, self._moves = setup.description, filters, moves
        self._dynamics = InverseDynamics(setup.description, body(setup.payload))

    def plan(self, command: MoveTrajectory, now: PlanningState) -> PlannedMove:
        """Plan a trajectory from rest, or refuse it at the first point that breaks a limit."""
        law = _law(command, now)
        path, limits, arms = JointLine(now.q, law.samples[-1]), law.limits, arm_limits(self._description)
        tvist = self._filters.like(now.filter)
        tvist.reset(now.q)
        tvist.aim(path.end)
        rest = np.repeat(law.samples[-1:], len(tvist.window()), axis=0)
        shaped = tvist.filter_all(np.concatenate((law.samples, rest)))
        late = STANDING + round(tvist.delay / PERIOD)
        unshaped = self._faults(law.samples, UNSHAPED, STANDING, "", now)
        faults = [*unshaped, *self._faults(shaped, SHAPED, late, "after shaping, ", now)]
        if faults:
            tick, late, code, why, limit = min(faults, key=lambda fault: fault[0])
            time = max(tick - late, 0) * PERIOD
            times = [point.time for point in command.points]
            where = f"points[{min(int(np.searchsorted(times, time - SLACK)), len(times) - 1)}]"
            raise RefusalError(code, where, f"{where}: {time:.3f} s after the start, {why}", limit)
        rate = rate_of(now.speed, limits.velocity, now.slowest)
        motion = TimedMotion(path, law, rate, at_least(limits, AGILE.acceleration, AGILE.jerk))
        room = arms.velocity / limits.velocity, arms.acceleration / limits.acceleration
        return PlannedMove((motion,), limits.velocity, None, room=room, excess_at_limits=now.excess_at_limits)

    def _values(self, name: str, q: Floats, now: PlanningState) -> tuple[Floats, int]:
        """Return a quantity along positions, one per tick, by differences, and the tick of its first row."""
        if name != "torque":
            order = UNSHAPED.index(name)  # a corner at a point counts for the tick of this point or before
            return np.diff(q, order, axis=0) / PERIOD**order, (0, 1, 1, 2)[order]
        states, torques = central_differences(q), []
        for parameters in now.bodies:
            self._dynamics.use_bodies((parameters,))
            torques.append(np.abs(self._dynamics.torques(*states)))
        return np.max(torques, axis=0), 1

    def _faults(
        self, q: Floats, names: Sequence[str], late: int, how: str, now: PlanningState
    ) -> Iterator[tuple[int, int, Code, str, float]]:
        """Yield tick, `late`, code, reason and limit where positions first break each named limit, or collide.

        Positions q, one per tick, have shape (t, n) [rad] and start to move, on average, after `late` ticks.
        """
        limits, joints = self._description.limits, self._description.robot.joints
        for name in names:
            code, words, unit, remedy = _REFUSALS[name]
            values, first = self._values(name, q, now)
            most = np.array(getattr(limits, name))
            beyond = np.abs(values) > most * (1.0 + ROUNDING)
            if not beyond.any():
                continue
            row = int(np.argmax(beyond.any(axis=1)))
            joint = int(np.argmax(np.abs(values[row]) / most))
            what = f"{how}joint {joints[joint]} would {words} {values[row, joint]:.4g} {unit}"
            must = f"must be within ±{most[joint]:.4g} {unit}; {remedy}"
            yield row + first, late, code, f"{what}: {must}", float(most[joint])
        found = self._moves.meeting(CheckedMotion.through(q), now)
        if found is not None:
            tick = round(found[0] * (len(q) - 1))
            why = f"{how}{found[1]}: choose points with another way between them"
            yield tick, late, "collision", why, CLEARANCE


def _law(command: MoveTrajectory, now: PlanningState) -> PointLaw:
    """Return the interpolation from the present reference; refuse a first point that is not there."""
    columns = ([getattr(point, name) for point in command.points] for name in ("time", "q", "qd", "qdd"))
    arrays: list[Any] = [None if column[0] is None else np.array(column) for column in columns]
    times, q, *_ = arrays
    if times[0] > 0.0:  # the start is no point: add it, at rest
        arrays = [None if array is None else np.insert(array, 0, 0.0, axis=0) for array in arrays]
    elif (far := np.abs(q[0] - now.q) > NEAR).any():
        joint = int(np.argmax(far))
        must = f"within {NEAR:g} rad of {now.q[joint]:.4f}, where the arm is: begin there, or give it a later time"
        raise invalid(f"points[0].q[{joint}]", f"{q[0, joint]:.4f} rad", must, NEAR)
    arrays[1][0] = now.q
    return PointLaw(*arrays)
