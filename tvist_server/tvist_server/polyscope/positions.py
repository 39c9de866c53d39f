"""Waypoints taught on a robot: joint angles, and the TCP's pose, computed with that robot's calibration."""

from math import cos, sin
from xml.etree.ElementTree import Element

import numpy as np

from tvist_controller.kinematics.pose import Placement, placement
from tvist_server.polyscope.installation import Pose, numbers


def joint_angles(position: Element) -> Pose:
    """Return the joint angles of a position [rad]; ValueError if there are none."""
    joints = position.find("JointAngles")
    return numbers(None if joints is None else joints.get("angles"), 6)


def tool_pose(position: Element) -> Pose:
    """Return the pose of the TCP in the base frame [m, rotation vector in rad], by Denavit-Hartenberg parameters."""
    q, kinematics, offset = joint_angles(position), position.find("Kinematics"), position.find("TCPOffset")
    if kinematics is None:
        raise ValueError("a position without kinematics")
    parts = (kinematics.find(name) for name in ("deltaTheta", "a", "d", "alpha"))
    theta, a, d, alpha = (numbers(None if part is None else part.get("value"), 6) for part in parts)
    at = placement(None)
    for link in zip(np.add(q, theta).tolist(), a, d, alpha, strict=True):
        at @= _link(*link)
    return (at @ placement(None if offset is None else numbers(offset.get("pose"), 6))).vector


def _link(theta: float, a: float, d: float, alpha: float) -> Placement:
    """Return a link's placement (Denavit and Hartenberg, 1955; UR's article on DH parameters)."""
    ct, st, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
    rotation = np.array([[ct, -st * ca, st * sa], [st, ct * ca, -ct * sa], [0.0, sa, ca]])
    return Placement(rotation, np.array([a * ct, a * st, d]))
