"""Waypoints taught on a robot: joint angles, and the pose of the TCP by that robot's calibrated kinematics."""

from math import cos, sin
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tvist_server.polyscope.installation import Pose, numbers

Matrix = NDArray[np.float64]
"""Homogeneous transformation, shape (4, 4)."""


def joint_angles(position: Element) -> Pose:
    """Return the joint angles of a position [rad]; ValueError if there are none."""
    joints = position.find("JointAngles")
    return numbers(None if joints is None else joints.get("angles"), 6)


def tool_pose(position: Element) -> Pose:
    """Return the pose of the TCP in the base frame [m, rotation vector in rad], of Denavit-Hartenberg parameters."""
    q, kinematics, offset = joint_angles(position), position.find("Kinematics"), position.find("TCPOffset")
    if kinematics is None:
        raise ValueError("a position without kinematics")
    parts = (kinematics.find(name) for name in ("deltaTheta", "a", "d", "alpha"))
    theta, a, d, alpha = (numbers(None if part is None else part.get("value"), 6) for part in parts)
    at = np.eye(4)
    for link in zip(np.add(q, theta), a, d, alpha, strict=True):
        at = at @ _link(*link)
    if offset is not None:
        at = at @ _transformation(numbers(offset.get("pose"), 6))
    return (*map(float, at[:3, 3]), *map(float, Rotation.from_matrix(at[:3, :3]).as_rotvec()))


def _link(theta: float, a: float, d: float, alpha: float) -> Matrix:
    """Return a link's transformation (Denavit and Hartenberg, 1955; UR's article on DH parameters)."""
    ct, st, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
    return np.array(
        [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1.0]]
    )


def _transformation(pose: Pose) -> Matrix:
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = Rotation.from_rotvec(pose[3:]).as_matrix(), pose[:3]
    return found
