"""Inverse kinematics: the nearest joint positions for a pose of the flange, in closed form or by search."""

import math
from typing import Literal

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.least_squares import ACCURACY, AIM, approach, descend, put
from tvist_controller.kinematics.pose import locate, pose_error
from tvist_controller.kinematics.postures import ANY, DEFINITE, FREE, arm_table, postures, representation
from tvist_kernels.compiling import inlined
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats

FOUND, NO_SOLUTION, OUT_OF_RANGE = 0, 1, 2
ON_CURVE = 4
"""Added to FOUND etc. if a joint is free and a curve of postures was searched, taking many times longer."""

SAMPLES = 96  # values of a free angle at which postures are computed before the nearest are refined
SPREAD = (53, 59)  # steps of the second and third free angle; any two angles then fill a square evenly

OUTSIDE = 1e6  # Penalty on the squared distance of a posture outside a joint's range [rad^2]


@compiled
def represent(arm: Floats, near: Floats, q: Floats) -> tuple[float, bool]:
    """Bring q nearest to `near` by whole turns; return squared distance [rad^2] and whether q is in range."""
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
    """Compute all postures as `postures` does; if they form curves, compute the nearest to `near` on each."""
    freedom = postures(arm, rotation, position, (0.0, 0.0, 0.0), table)
    if freedom == FREE:
        _sample_curves(arm, chain, rotation, position, near, table)
    return freedom


@inlined
def _sample_curves(
    arm: Floats, chain: Floats, rotation: Floats, position: Floats, near: Floats, table: Floats
) -> None:
    """Sample the free angles, then move the nearest posture of each row along its curve towards `near`."""
    sample, least = np.empty((8, 6)), np.empty(8)
    for row in range(8):
        table[row, 0], least[row] = math.nan, math.inf
    for number in range(SAMPLES):
        free = (
            2.0 * math.pi * number / SAMPLES,
            2.0 * math.pi * (SPREAD[0] * number % SAMPLES) / SAMPLES,
            2.0 * math.pi * (SPREAD[1] * number % SAMPLES) / SAMPLES,
        )
        postures(arm, rotation, position, free, sample)
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
    """Find the posture next to `near` by search: rounding near singularities shifts results of `postures`."""
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

    `found` has two rows per start: the solution, and the posture nearest to `near` after moving from the
    solution at constant pose. Rows without result begin with NaN. Return -1 if no posture is within the
    joints' ranges.
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


STARTS = 63  # number of further start postures for an arm without closed form


class InverseKinematicsError(ValueError):
    """No joint positions reach the pose, or only positions beyond the limit of a joint, `limit` [rad]."""

    def __init__(self, message: str, limit: float | None = None) -> None:
        super().__init__(message)
        self.code: Literal["no_solution", "limit_position"]
        self.code, self.limit = "no_solution" if limit is None else "limit_position", limit


class InverseKinematics:
    """Nearest posture with a given pose of the flange.

    UR arms and arms with a spherical wrist have a closed form (`postures`). Others are solved by damped least
    squares from 64 fixed starts, which may miss a posture.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._names = description.robot.joints
        self._arm, self._chain = arm_table(description), Arm(description).chain
        self._limits = self._arm[:-1, 4]
        self._closed = bool(self._arm[-1, 0] != ANY)
        span = np.minimum(self._limits, np.pi)
        self.searched = not self._closed
        """Whether the last `solve` searched a curve of postures, or had no closed form."""
        self._starts = np.random.default_rng(1).uniform(-span, span, (STARTS, description.joints))

    def solve(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        """Return the posture nearest to `near` (Euclidean, in joint space) with this pose of the flange.

        Each joint's turn count is the nearest in its range. If sin q₅ = 0 or another joint is free, the
        nearest posture of that curve is returned; if two are free, a nearer one may be missed. The pose is
        accurate to 1e-9 m and 1e-9 rad. Raise InverseKinematicsError if no posture is in range.
        """
        # Same memory layout, so that kernels are compiled only once.
        rotation, position, near = (np.array(given, float, order="C") for given in (rotation, position, near))
        if not self._closed:
            return self._search(rotation, position, near)
        q = near.copy()
        status = closest(self._arm, self._chain, rotation, position, near, q)
        self.searched = status >= ON_CURVE
        status %= ON_CURVE
        if status != FOUND:
            raise self._error(None if status == NO_SOLUTION else q)
        return q

    def _search(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        found = np.empty((2 * STARTS + 2, len(near)))
        best = search(self._arm, self._chain, self._starts, rotation, position, near, found)
        if best >= 0:
            return np.array(found[best])
        found = found[~np.isnan(found[:, 0])]
        raise self._error(found[np.argmin(np.linalg.norm(found - near, axis=1))] if len(found) else None)

    def _error(self, q: Floats | None) -> InverseKinematicsError:
        """Return the error: no posture reaches the pose (q is None), or a joint would be out of range."""
        if q is None:
            return InverseKinematicsError("no joint positions reach this pose")
        joint = int(np.argmax(np.abs(q) - self._limits))
        value, limit = float(q[joint]), float(self._limits[joint])
        why = f"{self._names[joint]} would be at {value:.4f} rad, outside its range of ±{limit:.4f} rad"
        return InverseKinematicsError(why, limit)
