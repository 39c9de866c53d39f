"""All postures of a six-joint arm at a flange pose, in closed form.

Two forms are solved; a and d may have any value and sign unless named:

- Axes 2, 3 and 4 parallel (UR): α = ±90°, 0 or 180°, 0 or 180°, ±90°, ±90°, any; a₅ = 0.
- Axes 4, 5 and 6 intersect (spherical wrist): α = ±90°, 0 or 180°, ±90°, ±90°, ±90°, any; a₄ = a₅ = d₅ = 0.

Axis 1 turns a plane in which upper arm and forearm move; its fixed distance from axis 1 allows two shoulder positions.
In the plane the triangle of upper arm and forearm has two forms, and the wrist two postures, q₅ and -q₅: up to eight in
all. All angles come from atan2, so rounding errors of the pose are not amplified, even near singularities.

If axes coincide, one joint is free and the postures form a curve; if two are free, a surface. The parameters
are q₁ if the wrist centre is on axis 1; the direction of frame 4 in the plane (UR, axes 4 and 6 parallel) or
q₄ (spherical wrist) if sin q₅ = 0; q₂ if the wrist is on axis 2.
"""

import math

import numpy as np

from tvist_controller._compiled import compiled
from tvist_kernels.compiling import inlined
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats

ANY, PARALLEL, SPHERICAL = 0.0, 1.0, 2.0
"""No closed form; axes 2, 3 and 4 parallel (UR); axes 4, 5 and 6 intersect (spherical wrist)."""

EXACT = 1e-9  # tolerance of a sine, cosine or length [m] for recognising a form

AT_BORDER = 1e-10
"""Distance [m] beyond the reach that counts as rounding; sine or length [m] below which a joint is free."""

AMPLIFIED = 1e-6  # sine or length [m] below which an angle amplifies the pose's rounding a million times

DEFINITE, LOOSE, FREE = 0, 1, 2
"""No angle is free; one nearly is and amplifies rounding of the pose; one is free."""

Point = tuple[float, float]
Vector = tuple[float, float, float]
Triangles = tuple[float, float, float, float]


def arm_table(description: RobotDescription) -> Floats:
    """Return an arm's constants for the closed form of inverse kinematics, shape (n + 1, 5).

    The first n rows have a, d [m], cos α, sin α (zero for an arm with placements) and the position limit [rad] of each
    joint, which turns about z before Tz(d) Tx(a) Rx(α). The last row has the form, the forearm's length l₃ [m] between
    the axes of elbow and wrist in the arm's plane, and its angle ψ to the x axis of its DH frame [rad].
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
    """Return whether an arm has six joints with parallel axes 2, 3 and 4, as UR's arms."""
    return bool(arm_table(description)[-1, 0] == PARALLEL)


def _form(dh: Floats) -> float:
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
    """Add whole turns to an angle: nearest to `near` within ± limit or, if none is within, nearest to 0."""
    turn = 2.0 * math.pi
    value = angle + turn * math.floor((near - angle) / turn + 0.5)
    if abs(value) <= limit:
        return value
    # Tolerate rounding errors of angles exactly at the limit.
    fewest, most = math.ceil((-limit - 1e-10 - angle) / turn), math.floor((limit + 1e-10 - angle) / turn)
    if fewest > most:
        return angle - turn * math.floor(angle / turn + 0.5)
    value = angle + turn * min(max(math.floor((near - angle) / turn + 0.5), fewest), most)
    return min(max(value, -limit), limit)


@compiled
def freedom_at(length: float) -> int:
    """Return whether an angle is DEFINITE, LOOSE or FREE, from the sine or length that determines it."""
    if length < AT_BORDER:
        return FREE
    return LOOSE if length < AMPLIFIED else DEFINITE


@compiled
def elbow(
    upper: float, forearm: float, x: float, y: float, slack: float, free: float
) -> tuple[Triangles, int]:
    """Solve the triangle of upper arm and forearm with its far end at (x, y).

    Return (θ₂, δ, θ₂', δ'), the angles of the upper arm and from it to the forearm for both forms [rad], NaN
    without solution; and DEFINITE, LOOSE, or FREE if θ₂ is free and set to `free`.
    """
    square = x * x + y * y
    radius = math.sqrt(square)
    longest, shortest = abs(upper) + abs(forearm), abs(abs(upper) - abs(forearm))
    if not (shortest - slack <= radius <= longest + slack):
        return (math.nan, math.nan, math.nan, math.nan), DEFINITE
    scale = 2.0 * upper * forearm
    cosine = (square - upper * upper - forearm * forearm) / scale
    area = (radius - shortest) * (radius + shortest) * (longest - radius) * (longest + radius)
    sine = math.sqrt(max(area, 0.0)) / abs(scale)
    delta = math.atan2(sine, cosine)
    freedom = freedom_at(radius)
    if freedom == FREE:
        return (free, delta, free, delta), freedom
    middle = math.atan2(y, x)
    aside = math.atan2(forearm * sine, upper + forearm * cosine)
    return (middle - aside, delta, middle + aside, -delta), freedom


@compiled
def postures(
    arm: Floats,  # see `arm_table`, of one of the two forms
    rotation: Floats,  # of the flange, like its position
    position: Floats,
    free: Vector,  # values of q₁, the wrist's angle and q₂ where these are free [rad]
    table: Floats,  # result [rad], shape (8, 6) at least, in any representation
) -> int:
    """Compute all postures at a pose; return the largest of DEFINITE, LOOSE and FREE that applies.

    Row 4 shoulder + 2 wrist + elbow has a posture, or begins with NaN if there is none.
    """
    for row in range(8):
        table[row, 0] = math.nan
    # Axis 6 (z), the direction x that q₆ turns about it, and the origin of frame 5.
    a6, d6, ca6, sa6 = arm[5, 0], arm[5, 1], arm[5, 2], arm[5, 3]
    xx, xy, xz = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    zx = sa6 * rotation[0, 1] + ca6 * rotation[0, 2]
    zy = sa6 * rotation[1, 1] + ca6 * rotation[1, 2]
    zz = sa6 * rotation[2, 1] + ca6 * rotation[2, 2]
    px, py = position[0] - d6 * zx - a6 * xx, position[1] - d6 * zy - a6 * xy
    pz = position[2] - d6 * zz - a6 * xz - arm[0, 1]

    parallel = arm[6, 0] == PARALLEL
    s1 = arm[0, 3]
    distance = arm[1, 1] + arm[1, 2] * arm[2, 1]
    if parallel:
        distance += arm[1, 2] * arm[2, 2] * arm[3, 1]
    distance *= s1
    radius = math.hypot(px, py)
    if not (abs(distance) <= radius + AT_BORDER):
        return DEFINITE
    distance = min(max(distance, -radius), radius)
    along = math.sqrt((radius - distance) * (radius + distance))
    freedom = freedom_at(radius)
    turns = freedom == FREE
    for shoulder in range(2):
        if turns:
            q1 = free[0] + math.pi * shoulder
            c, s = math.cos(q1), math.sin(q1)
        else:
            c = (along * px - distance * py) / (radius * radius)
            s = (along * py + distance * px) / (radius * radius)
            q1 = math.atan2(s, c)
        # In the arm's plane: first coordinate horizontal, second up or down, third along axis 2.
        pose = (
            (c * px + s * py - arm[0, 0], s1 * pz),
            (c * xx + s * xy, s1 * xz, s1 * (s * xx - c * xy)),
            (c * zx + s * zy, s1 * zz, s1 * (s * zx - c * zy)),
        )
        rows = table[4 * shoulder : 4 * shoulder + 4]
        if parallel:
            freedom = max(freedom, _parallel(arm, q1, pose, free, rows))
        else:
            freedom = max(freedom, _spherical(arm, q1, pose, turns, free, rows))
        along = -along
    return freedom


@inlined
def _parallel(arm: Floats, q1: float, pose: tuple[Point, Vector, Vector], free: Vector, rows: Floats) -> int:
    """Compute the four postures of a UR arm at one shoulder position."""
    (px, py), (xx, xy, xu), (zx, zy, zu) = pose
    e2 = arm[1, 2]
    along = e2 * arm[2, 2]  # axis 4 along axis 2, or against it
    s4, s5 = along * arm[3, 3], arm[4, 3]
    c5 = -s5 * s4 * zu
    sine = math.hypot(zx, zy)
    freedom = freedom_at(sine)
    straight = freedom == FREE
    slack = AT_BORDER
    if straight:
        q5 = 0.0 if c5 > 0.0 else math.pi
        hx, hy, sine = math.cos(free[1]), math.sin(free[1]), 0.0
    else:
        q5 = math.atan2(sine, c5)
        hx, hy = s5 * zx / sine, s5 * zy / sine
        slack += 1e-15 * abs(arm[4, 1]) / sine  # rounding of the pose turns frame 4
    # x axis of frame 4 (h) and its z axis, which is axis 5.
    q6 = math.atan2(s5 * s4 * (xx * hy - xy * hx), c5 * (xx * hx + xy * hy) + sine * s4 * xu)
    theta4 = math.atan2(hy, hx)
    wx = arm[4, 1] * s4 * hy + arm[3, 0] * hx
    wy = -arm[4, 1] * s4 * hx + arm[3, 0] * hy
    for wrist in range(1 if straight else 2):
        ways, triangle = elbow(arm[1, 0], arm[6, 1], px - wx, py - wy, slack, free[2])
        freedom = max(freedom, triangle)
        for way in range(2):
            theta2, delta = ways[2 * way], ways[2 * way + 1]
            row = rows[2 * wrist + way]
            if math.isnan(theta2):
                row[0] = math.nan
                continue
            row[0], row[1], row[2] = q1, theta2, e2 * delta
            row[3], row[4], row[5] = along * (theta4 - theta2 - delta), q5, q6
        wx, wy, q5 = -wx, -wy, -q5
        theta4, q6 = theta4 + math.pi, q6 + math.pi
    return freedom


@inlined
def _spherical(
    arm: Floats, q1: float, pose: tuple[Point, Vector, Vector], turns: bool, free: Vector, rows: Floats
) -> int:
    """Compute the four postures of an arm with a spherical wrist at one shoulder position."""
    (px, py), (xx, xy, xu), (zx, zy, zu) = pose
    e2, s3, s4, s5 = arm[1, 2], arm[2, 3], arm[3, 3], arm[4, 3]
    ways, freedom = elbow(arm[1, 0], arm[6, 1], px, py, AT_BORDER, free[2])
    for way in range(2):
        theta2, delta = ways[2 * way], ways[2 * way + 1]
        if math.isnan(theta2):
            continue
        theta3 = theta2 + delta - arm[6, 2]
        c, s = math.cos(theta3), math.sin(theta3)
        # Axis 6 (v) and the direction that q₆ turns (w) in frame 3, whose z axis is axis 4.
        side, up = s3 * e2, -s3 * e2
        vx, vy, vz = c * zx + s * zy, side * zu, up * (c * zy - s * zx)
        wx, wy, wz = c * xx + s * xy, side * xu, up * (c * xy - s * xx)
        c5 = -s5 * s4 * vz
        sine = math.hypot(vx, vy)
        wrist_freedom = freedom_at(sine)
        # An elbow at its end amplifies rounding; a free axis 1 shows that the wrist is meant to be straight.
        straight = wrist_freedom == FREE or (turns and wrist_freedom == LOOSE)
        freedom = max(freedom, wrist_freedom)
        if straight:
            q4, q5, sine = free[1], 0.0 if c5 > 0.0 else math.pi, 0.0
            hx, hy = math.cos(free[1]), math.sin(free[1])
        else:
            q5 = math.atan2(sine, c5)
            hx, hy = s5 * vx / sine, s5 * vy / sine
            q4 = math.atan2(hy, hx)
        q6 = math.atan2(s5 * s4 * (wx * hy - wy * hx), c5 * (wx * hx + wy * hy) + sine * s4 * wz)
        for wrist in range(1 if straight else 2):
            row = rows[2 * wrist + way]
            row[0], row[1], row[2] = q1, theta2, e2 * (theta3 - theta2)
            row[3], row[4], row[5] = q4 + math.pi * wrist, q5 * (1.0 - 2.0 * wrist), q6 + math.pi * wrist
    return freedom
