"""The form of an arm, as far as it decides how its inverse kinematics is computed."""

import math

import numpy as np

from tvist_kernels.compiling import inlined
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats

ANY, PARALLEL, SPHERICAL = 0.0, 1.0, 2.0
"""No closed form; axes 2, 3 and 4 are parallel (UR); axes 4, 5 and 6 meet in one point (spherical wrist)."""

EXACT = 1e-9
"""Deviation of a sine, a cosine or a length [m] from the form that still counts as the form."""


def arm_table(description: RobotDescription) -> Floats:
    """Return what the closed form of inverse kinematics needs to know of an arm, shape (n + 1, 5).

    The first n rows have a, d [m], cos α and sin α of each joint, whose turn about z is followed by Tz(d) Tx(a) Rx(α);
    they are zero for an arm with placements. The fifth column has the joint's largest distance from zero [rad]. The
    last row has the form (`ANY`, `PARALLEL` or `SPHERICAL`), the length l₃ [m] of the forearm between the axes of elbow
    and wrist in the arm's plane, and its angle ψ [rad] to the x axis of its Denavit-Hartenberg frame.
    """
    table = np.zeros((description.joints + 1, 5))
    table[:-1, 4] = description.limits.position
    if description.kinematics.placement:
        return table
    links, alpha = description.kinematics, np.array(description.kinematics.alpha)
    table[:-1, :4] = dh = np.column_stack((links.a, links.d, np.cos(alpha), np.sin(alpha)))
    form = _form(dh)
    forearm, angle = 0.0, 0.0
    if form == PARALLEL:
        forearm = dh[2, 0]
    elif form == SPHERICAL:
        forearm = math.hypot(dh[2, 0], dh[3, 1])
        angle = math.atan2(-dh[2, 3] * dh[1, 2] * dh[3, 1], dh[2, 0])
    table[-1, :3] = form, forearm, angle
    return table


def is_of_ur_form(description: RobotDescription) -> bool:
    """Return whether an arm has six joints, of which the axes 2, 3 and 4 are parallel, as UR's arms have."""
    return bool(arm_table(description)[-1, 0] == PARALLEL)


def _form(dh: Floats) -> float:
    """Recognise a form that `postures` solves."""
    if len(dh) != 6:
        return ANY
    a, d, cosine, sine = dh.T
    turned, straight = np.abs(cosine) < EXACT, np.abs(sine) < EXACT
    if not (turned[0] and straight[1] and turned[3] and turned[4] and abs(a[1]) > EXACT):
        return ANY
    if straight[2] and abs(a[2]) > EXACT and abs(a[4]) < EXACT:
        return PARALLEL
    meet = max(abs(a[3]), abs(a[4]), abs(d[4])) < EXACT
    if turned[2] and meet and math.hypot(a[2], d[3]) > EXACT:
        return SPHERICAL
    return ANY


@inlined
def representation(angle: float, near: float, limit: float) -> float:
    """Add the whole turns to an angle that bring it nearest to `near` within ± limit.

    If none of its representations is in the range, the one nearest to zero is returned.
    """
    turn = 2.0 * math.pi
    value = angle + turn * math.floor((near - angle) / turn + 0.5)
    if abs(value) <= limit:
        return value
    # A limit is a number in a file, and an angle that should be on it is beyond it by rounding half of the time.
    fewest, most = math.ceil((-limit - 1e-10 - angle) / turn), math.floor((limit + 1e-10 - angle) / turn)
    if fewest > most:
        return angle - turn * math.floor(angle / turn + 0.5)
    value = angle + turn * min(max(math.floor((near - angle) / turn + 0.5), fewest), most)
    return min(max(value, -limit), limit)
