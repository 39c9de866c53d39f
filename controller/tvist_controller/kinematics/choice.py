"""The posture nearest to a given one among all with the same pose, in closed form or by search."""

import math

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.kinematics.least_squares import ACCURACY, AIM, approach, descend, put
from tvist_controller.kinematics.pose import locate, pose_error
from tvist_controller.kinematics.postures import DEFINITE, FREE, postures, representation
from tvist_kernels.compiling import inlined
from tvist_plant.model import Floats

FOUND, NO_SOLUTION, OUT_OF_RANGE = 0, 1, 2
ON_CURVE = 4
"""Added to these if a joint is free and a curve of postures was searched, which takes many times longer."""

SAMPLES = 96  # values of a free angle at which postures are computed before the nearest are refined

OUTSIDE = 1e6  # Penalty on the squared distance of a posture outside a joint's range [rad^2]


@compiled
def represent(arm: Floats, near: Floats, q: Floats) -> tuple[float, bool]:
    """Bring q nearest to `near` by whole turns; return squared distance [rad^2], and whether in range."""
    square, inside = 0.0, True
    for i in range(len(q)):
        q[i] = representation(q[i], near[i], arm[i, 4])
        inside &= abs(q[i]) <= arm[i, 4]
        square += (q[i] - near[i]) * (q[i] - near[i])
    return square, inside


@inlined
def all_postures(
    arm: Floats,  # see `arm_table`, shape (7, 5)
    chain: Floats,  # the links to the flange, see `tvist_plant.chain`, shape (7, 22)
    rotation: Floats,  # of the flange, like its position
    position: Floats,
    near: Floats,  # joint positions, shape (6,) [rad]
    table: Floats,  # result, shape (8, 6) at least [rad]; rows without posture begin with NaN
) -> int:
    """Compute all postures as `postures` does; if they form a curve, those nearest to `near`."""
    freedom = postures(arm, rotation, position, 0.0, table)
    if freedom == FREE:
        _sample_curves(arm, chain, rotation, position, near, table)
    return freedom


@inlined
def _sample_curves(
    arm: Floats, chain: Floats, rotation: Floats, position: Floats, near: Floats, table: Floats
) -> None:
    """Sample the free angle, then move the nearest posture of each kind along its curve."""
    sample, least = np.empty((8, 6)), np.empty(8)
    for row in range(8):
        table[row, 0], least[row] = math.nan, math.inf
    for number in range(SAMPLES):
        postures(arm, rotation, position, 2.0 * math.pi * number / SAMPLES, sample)
        for row in range(8):
            if math.isnan(sample[row, 0]):
                continue
            square, inside = represent(arm, near, sample[row])
            square += 0.0 if inside else OUTSIDE
            if square < least[row]:
                least[row] = square
                put(sample[row], table[row])
    for row in range(8):
        if math.isnan(table[row, 0]):
            continue
        posture = table[row].copy()
        if approach(chain, rotation, position, near, posture) <= ACCURACY:
            _, inside = represent(arm, near, posture)
            # Refinement may leave the joint ranges.
            if inside or least[row] >= OUTSIDE:
                put(posture, table[row])


@inlined
def _start_from_near(
    chain: Floats, rotation: Floats, position: Floats, near: Floats, on_curve: bool, row: Floats
) -> None:
    """Find the posture next to `near`; rounding near singularities moves those of `postures` away."""
    posture = near.copy()
    if descend(chain, rotation, position, near, 0.0, 30, posture) <= ACCURACY:
        if on_curve:
            approach(chain, rotation, position, near, posture)
        put(posture, row)


@compiled
def closest(arm: Floats, chain: Floats, rotation: Floats, position: Floats, near: Floats, q: Floats) -> int:
    """Find the nearest posture in closed form; return FOUND, NO_SOLUTION or OUT_OF_RANGE, plus ON_CURVE."""
    table = np.empty((9, 6))
    table[8, 0] = math.nan
    freedom = all_postures(arm, chain, rotation, position, near, table)
    curve = ON_CURVE if freedom == FREE else 0
    if freedom != DEFINITE:
        _start_from_near(chain, rotation, position, near, freedom == FREE, table[8])
    squares, outside = np.empty(9), np.empty(9)
    for row in range(9):
        squares[row] = math.inf
        outside[row] = 0.0
        if not math.isnan(table[row, 0]):
            square, inside = represent(arm, near, table[row])
            squares[row] = square
            outside[row] = 0.0 if inside else 1.0
    now, place, J, error = np.empty((3, 3)), np.empty(3), np.empty((6, 6)), np.empty(6)
    for wrong in range(2):
        while True:
            best, least = -1, math.inf
            for row in range(9):
                if outside[row] == wrong and squares[row] < least:
                    best, least = row, squares[row]
            if best < 0:
                break
            put(table[best], q)
            locate(chain, q, now, place, J)
            far, angle = pose_error(rotation, position, now, place, error)
            # Negated so that NaN fails.
            if max(far, angle) <= AIM or descend(chain, rotation, position, near, 0.0, 5, q) <= ACCURACY:
                return (OUT_OF_RANGE if wrong else FOUND) + curve
            squares[best] = math.inf
    return NO_SOLUTION + curve


@compiled
def search(
    arm: Floats,  # for this and the other arguments see `all_postures`, with n joints
    chain: Floats,
    starts: Floats,  # further starts, shape (k, n) [rad]
    rotation: Floats,
    position: Floats,
    near: Floats,
    found: Floats,  # result, shape (2 k + 2, n) [rad]
) -> int:
    """Find postures of any arm by least squares from `near` and other starts; return the nearest's index.

    `found` has two rows per start: the solution, and the nearest to `near` reachable from it at this pose;
    rows without result begin with NaN. Return -1 if no posture is within the joints' ranges.
    """
    best, least = -1, math.inf
    for start in range(len(starts) + 1):
        first, second = found[2 * start], found[2 * start + 1]
        put(near if start == 0 else starts[start - 1], first)
        second[0] = math.nan
        if not descend(chain, rotation, position, near, 0.0, 100, first) <= ACCURACY:
            first[0] = math.nan
            continue
        represent(arm, near, first)
        put(first, second)
        if not approach(chain, rotation, position, near, second) <= ACCURACY:
            second[0] = math.nan
        for row in range(2 * start, 2 * start + 2):
            if not math.isnan(found[row, 0]):
                square, inside = represent(arm, near, found[row])
                if inside and square < least:
                    best, least = row, square
    return best
