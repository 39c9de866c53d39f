"""Random motions in space and guided motions, for sequences of commands."""

from collections.abc import Callable

import numpy as np
from tests.search import draws
from tests.search.subject import Subject

from tvist_controller.api.line import Arm, placement_vector, turned
from tvist_protocol import motions as m
from tvist_protocol.replies import Reply

Random = np.random.Generator

NEAR, TURN = 0.2, 0.6
"""Largest distance [m] and turn [rad] of a random pose from the present one, along and about each axis."""


def _pose(robot, random, share=1.0):
    """A pose of the flange near the present one."""
    return pose_near(Arm(robot.description), robot.references[-1], random, share)


def pose_near(kinematics, q, random, share=1.0):
    """Return a random pose near that of the tool at a posture."""
    rotation, position = kinematics.pose(q)
    moved = position + share * random.uniform(-NEAR, NEAR, 3)
    return placement_vector(turned(rotation, share * random.uniform(-TURN, TURN, 3)), moved)


def _pace(random):
    return {"velocity": float(random.uniform(0.05, 0.8)), "acceleration": float(random.uniform(0.3, 4.0))}


def line(robot, random):
    duration = float(random.uniform(0.3, 4.0)) if random.random() < 0.2 else None
    return robot.send(m.MoveL, pose=_pose(robot, random), duration=duration, **_pace(random))


def arc(robot, random):
    orientation = str(random.choice(["interpolated", "tangent"]))
    via, pose = _pose(robot, random, 0.4), _pose(robot, random)
    return robot.send(m.MoveC, via=via, pose=pose, orientation=orientation, **_pace(random))


def path(robot, random):
    segments: list[m.Segment] = []
    for _ in range(int(random.integers(2, 5))):
        blend = float(random.choice([0.0, 0.02, 0.05]))
        if random.random() < 0.25:
            q = robot.references[-1] + random.uniform(-0.5, 0.5, robot.description.joints)
            segments.append(m.JointSegment(q=tuple(q.tolist()), blend=blend))
        else:
            kind = m.LineSegment if random.random() < 0.5 else m.ProcessSegment
            segments.append(kind(pose=_pose(robot, random), blend=blend, **_pace(random)))
    return robot.send(m.MovePath, segments=tuple(segments))


def trajectory(robot, random):
    kind = str(random.choice(["linear", "cubic", "quintic"]))
    return robot.send(m.MoveTrajectory, points=draws.points(random, robot.references[-1], kind))


def servo(robot, random):
    q = robot.references[-1] + random.uniform(-0.4, 0.4, robot.description.joints)
    limit = np.array(robot.description.limits.position)
    return robot.send(
        m.ServoJ,
        q=tuple(np.clip(q, -limit, limit).tolist()),
        lookahead=float(random.uniform(0.03, 0.2)),
        gain=float(random.uniform(100.0, 2000.0)),
        shaped=bool(random.random() < 0.2),
    )


def joint_speed(robot, random):
    limits = robot.description.limits
    shares = random.uniform(-0.6, 0.6, robot.description.joints)
    if random.random() < 0.3:
        shares[random.integers(len(shares))] = random.choice([-1.0, 1.0, 1.0001])
    qd = shares * limits.velocity * (random.random() > 0.15)
    acceleration = float(
        random.choice([random.uniform(0.5, 8.0), random.uniform(8.0, min(limits.acceleration))])
    )
    shaped = bool(random.random() < 0.2)
    return robot.send(m.SpeedJ, qd=tuple(qd.tolist()), acceleration=acceleration, shaped=shaped)


def tool_speed(robot, random):
    xd = random.uniform(-0.4, 0.4, 6) * (random.random() > 0.15)
    shaped = bool(random.random() < 0.2)
    return robot.send(
        m.SpeedL, xd=tuple(xd.tolist()), acceleration=float(random.uniform(0.3, 4.0)), shaped=shaped
    )


def stop(kind, most):
    """Return what sends a stop with a deceleration from 0.1 to 10 to the power of `most`."""
    return lambda robot, random: robot.send(kind, acceleration=float(10 ** random.uniform(-1, most)))


SENT: dict[str, tuple[float, Callable[[Subject, Random], Reply]]] = {
    "line": (6.0, line),
    "arc": (3.0, arc),
    "path": (4.0, path),
    "trajectory": (4.0, trajectory),
    "servo_j": (4.0, servo),
    "speed_j": (4.0, joint_speed),
    "speed_l": (4.0, tool_speed),
    "stop_j": (2.0, stop(m.StopJ, 1.6)),
    "stop_l": (2.0, stop(m.StopL, 1.0)),
}
"""Commands and their relative frequencies."""
