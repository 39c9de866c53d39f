"""Arms with known forms, their poses and degenerate postures, for the tests of inverse kinematics."""

import numpy as np
from tests.plant.arms import chain, changed, forward_kinematics

from tvist_controller.kinematics import choice
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.postures import ANY, arm_table
from tvist_plant.description import load

UR5E = load("ur5e")
RIGHT = np.pi / 2


def arm(a, d, alpha, limit=2 * np.pi):
    """A description with these parameters."""
    joints = len(a)
    base = UR5E if joints == 6 else chain(joints)
    base = changed(base, "kinematics", a=tuple(a), d=tuple(d), alpha=tuple(alpha))
    return changed(base, "limits", position=(limit,) * joints)


def random_ur(rng):
    """An arm with parallel axes 2, 3, 4 and lengths of any sign, some of them zero."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    a[[1, 2]] += np.sign(a[[1, 2]]) * 0.1
    a[4] = 0.0
    a[[0, 3, 5]] *= rng.integers(0, 2, 3)
    d *= rng.integers(0, 2, 6)
    d[3] += 0.1
    signs = rng.choice([-1, 1], 3) * RIGHT
    straight = rng.choice([0.0, np.pi, -np.pi], 2)
    return arm(a, d, (signs[0], *straight, signs[1], signs[2], rng.uniform(-np.pi, np.pi)))


def random_spherical(rng):
    """An arm with a spherical wrist and lengths of any sign, some of them zero."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    a[1] += np.sign(a[1]) * 0.1
    d[3] += np.sign(d[3]) * 0.1
    a[[3, 4]] = d[4] = 0.0
    a[[0, 2, 5]] *= rng.integers(0, 2, 3)
    d[[0, 1, 2, 5]] *= rng.integers(0, 2, 4)
    signs = rng.choice([-1, 1], 4) * RIGHT
    straight = rng.choice([0.0, np.pi, -np.pi])
    return arm(a, d, (signs[0], straight, *signs[1:], rng.uniform(-np.pi, np.pi)))


PUMA = arm(
    (0.0, 0.43, -0.02, 0.0, 0.0, 0.0),
    (0.67, 0.0, 0.15, 0.43, 0.0, 0.06),
    (RIGHT, 0.0, -RIGHT, RIGHT, -RIGHT, 0.0),
)
CENTRED = arm(
    (0.0, 0.4, 0.0, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.4, 0.0, 0.1), (RIGHT, 0.0, -RIGHT, RIGHT, -RIGHT, 0.0)
)
EVEN_UR = arm(
    (0.0, -0.4, -0.4, 0.0, 0.0, 0.0),
    (0.2, 0.1, -0.3, 0.2, 0.1, 0.1),
    (RIGHT, 0.0, 0.0, RIGHT, -RIGHT, 0.0),
)


def pose_of(description, q):
    return Arm(description).pose(np.asarray(q, dtype=float))


def error(description, pose, q):
    """Largest error of position [m] and rotation [rad], by the textbook's products."""
    found = forward_kinematics(description, q)
    return max(np.linalg.norm(found[:3, 3] - pose[1]), np.linalg.norm(found[:3, :3] - pose[0]) / np.sqrt(2))


def wrapped(difference):
    return np.remainder(difference + np.pi, 2 * np.pi) - np.pi


def improved(table, links, pose, near):
    """What `all_postures` finds, each improved as far as its error is not rounding; rows without one begin with NaN."""
    found = np.empty((8, 6))
    choice.all_postures(table, links, *pose, near, found)
    for row in range(8):
        if np.isnan(found[row, 0]):
            continue
        choice.represent(table, near, found[row])
        if choice.descend(links, *pose, near, 0.0, 5, found[row]) > choice.ACCURACY:
            found[row, 0] = np.nan
    return found


def every(description, pose):
    """The distinct postures that have a pose, whatever the ranges; those next to zero of a curve of them."""
    table, links, zero = arm_table(description), Arm(description).chain, np.zeros(description.joints)
    table[:-1, 4] = 2 * np.pi
    if table[-1, 0] != ANY:
        found = improved(table, links, pose, zero)
    else:
        starts = np.random.default_rng(1).uniform(-np.pi, np.pi, (63, description.joints))
        found = np.empty((128, description.joints))
        choice.search(table, links, starts, *pose, zero, found)
    kept = []
    for q in found[~np.isnan(found[:, 0])]:
        if all(np.abs(wrapped(q - other)).max() > 1e-6 for other in kept):
            kept.append(q)
    return np.array(kept).reshape(len(kept), description.joints)


def nearest(postures, near, limit):
    """The smallest distance, of all postures and all their representations in the range."""
    least = np.inf
    for posture in postures:
        total = 0.0
        for angle, wish, most in zip(posture, near, limit, strict=True):
            turned = angle + 2 * np.pi * np.arange(-3, 4)
            turned = turned[np.abs(turned) <= most]
            total += np.min((turned - wish) ** 2, initial=np.inf)
        least = min(least, total)
    return np.sqrt(least)


FREE = {
    "ur5e, Q1": (UR5E, UR5E.poses["Q1"]),
    "ur5e, Q2": (UR5E, UR5E.poses["Q2"]),
    "ur5e, Q3": (UR5E, UR5E.poses["Q3"]),
    "ur5e, wrist folded": (UR5E, (0.3, -1.0, 1.2, 0.4, np.pi, 0.7)),
    "ur5e, elbow folded": (UR5E, (0.3, -1.0, np.pi, 0.4, 0.6, 0.7)),
    "ur5e, stretched": (UR5E, (0.3, -1.0, 0.0, 0.4, 0.6, 0.7)),
    "ur, wrist on axis 1": (EVEN_UR, (0.3, -0.5, 1.0, -0.5 + RIGHT, 0.4, 0.7)),
    "ur, wrist on axis 2": (EVEN_UR, (0.3, -1.0, np.pi, 0.4, 0.6, 0.7)),
    "puma, wrist straight": (PUMA, (0.3, -1.0, 0.5, 0.4, 0.0, 0.7)),
    "puma, wrist folded": (PUMA, (0.3, -1.0, 0.5, 0.4, np.pi, 0.7)),
    "centred, wrist on axis 1": (CENTRED, (0.3, RIGHT, 0.0, 0.4, 0.6, 0.7)),
    "centred, upright": (CENTRED, (0.3, RIGHT, RIGHT, 0.4, 0.0, 0.7)),
    "centred, above": (CENTRED, (0.3, 1.0, 2 * (RIGHT - 1.0) + RIGHT, 0.4, 0.6, 0.7)),
    "centred, wrist on axis 2": (CENTRED, (0.3, 0.5, -RIGHT, 0.4, 0.6, 0.7)),
}
