"""Reads trajectories of ROS 2 and judges how they are followed."""

from collections.abc import Sequence
from typing import Any

from tvist_protocol import State, TrajectoryPoint, TvistError
from tvist_ros2.messages import seconds


class GoalError(TvistError):
    """A trajectory that cannot be carried out."""


def points_of(
    trajectory: Any, joints: Sequence[str], now: float, q: Sequence[float]
) -> list[TrajectoryPoint]:
    """Return the points of a JointTrajectory for `move_trajectory`, with the joints in the robot's order.

    A stamp of the header says when the trajectory starts; points whose time has passed at `now` are left out. If no
    point has velocities, all get those of a smooth curve from the posture `q`. GoalError if the joints are not the
    robot's, numbers are missing or all points have passed; the robot checks times and limits.
    """
    order = _order(trajectory.joint_names, joints)
    if not trajectory.points:
        raise GoalError("the trajectory has no points")
    points = [_point(number, point, order) for number, point in enumerate(trajectory.points)]
    start = seconds(trajectory.header.stamp)
    if start:
        passed = now - start
        points = [{**point, "time": point["time"] - passed} for point in points if point["time"] > passed]
        if not points:
            why = (
                f"the trajectory started {passed:.3f} s ago, and has ended: give the stamp 0 to start at once"
            )
            raise GoalError(why)
    if not any("qd" in point for point in points):
        _smooth(points, q)
    return [TrajectoryPoint(**point) for point in points]


def _point(number: int, point: Any, order: Sequence[int]) -> dict[str, Any]:
    """Return one point; GoalError if numbers are missing or too many."""
    read: dict[str, Any] = {"time": seconds(point.time_from_start)}
    for name, field in (("q", "positions"), ("qd", "velocities"), ("qdd", "accelerations")):
        values = getattr(point, field)
        if len(values) == len(order):
            read[name] = [values[place] for place in order]
        elif values or name == "q":
            why = f"points[{number}].{field} has {len(values)} numbers: must have {len(order)}"
            raise GoalError(why)
    return read


def _order(given: Sequence[str], joints: Sequence[str]) -> list[int]:
    """Return the place of each of the robot's joints among those given."""
    if sorted(given) != sorted(joints):
        why = f"the joints are {', '.join(given) or 'none'}: must be {', '.join(joints)}, in any order"
        raise GoalError(why)
    return [given.index(joint) for joint in joints]


def _smooth(points: list[dict[str, Any]], q: Sequence[float]) -> None:
    """Give points the velocities of a Catmull-Rom spline that starts and ends at rest."""
    passed = points if points[0]["time"] == 0.0 else [{"time": 0.0, "q": q}, *points]
    for point in points:
        point["qd"] = [0.0] * len(q)
    for before, point, after in zip(passed, passed[1:], passed[2:], strict=False):
        time = (after["time"] - before["time"]) or 1.0  # the robot refuses equal times
        point["qd"] = [(b - a) / time for a, b in zip(before["q"], after["q"], strict=True)]


class Tolerances:
    """Largest deviations of joints: JointTolerance messages, of which only positive numbers are limits."""

    def __init__(self, given: Sequence[Any], joints: Sequence[str]) -> None:
        """Raise GoalError if a joint is not among the robot's."""
        for tolerance in given:
            if tolerance.name not in joints:
                raise GoalError(f"a tolerance is for {tolerance.name!r}, which is no joint")
        self._given = [(joints.index(tolerance.name), tolerance) for tolerance in given]

    def violation(self, state: State) -> str | None:
        """Return which joint deviates too far from its shaped reference and how far; None if none does."""
        for joint, tolerance in self._given:
            for name, allowed, target, actual in (
                ("position", tolerance.position, state.target_q, state.actual_q),
                ("velocity", tolerance.velocity, state.target_qd, state.actual_qd),
            ):
                deviation = abs(target[joint] - actual[joint])
                if 0.0 < allowed < deviation:
                    most = f"at most {allowed:.6g} is allowed"
                    return f"{tolerance.name} deviates by {deviation:.6g} in {name}: {most}"
        return None
