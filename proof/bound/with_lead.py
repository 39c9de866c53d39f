"""The least time in which a straight line in joint space can be made if the motors lead by what the springs yield.

A lead that is exact leaves no vibration, whatever the reference. What it needs is torque: the lead is the load of the
springs over their stiffness, so that its acceleration follows the way's fourth derivative, s⁗, which no limit of the
motion bounds. With L(q) the lead for each rad/s² of s̈, and B the rotors' inertia, the motion is possible if

    B_j |L_j s⁗| <= 0.95 τ_max,j - F_j - |τ_j + B_j q̈_j|

in each tick and joint, beside |ṡ|, |s̈| and |s⃛|. L and what the target leaves of the torque are those of the unshaped
motion at the same share of the time. The bound is the least such time, less that without a lead.
"""

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog
from scipy.sparse import diags, vstack

from proof.bound.least_time import fewest
from tvist_controller.api.line import MotionLimits, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.study.case import Case
from tvist_lab.study.moves import Move
from tvist_plant.description import RobotDescription
from tvist_plant.model import FlexibleModel, flexible_model, rigid_model
from tvist_plant.plant import PERIOD

SHARE, LEAST = 0.95, 0.05
"""Shares of a drive's torque limit [-]: that motion and lead may need together, and that the lead may always need."""
DAMPED = 0.1
"""Lever arms that may be taken for none [m]."""
SLACK = 1e-6
"""Share of the way by which the solver may miss it [-]."""


def bound_with_lead(description: RobotDescription, move: Move, limits: MotionLimits) -> float:
    """Extra time that a motion needs so that the drives have torque enough for a lead without error [s].

    Args:
        description: The arm, of which everything is known.
        move: The move.
        limits: Limits of every joint.
    """
    reference = Case(description, move, limits=limits).reference()
    way = float(np.abs(reference[-1] - reference[0]).max())
    most = fastest_snaps(description, move, reference) / way
    least = _least(way, limits, np.full(len(most), np.inf), len(reference) - 4)
    return PERIOD * (_least(way, limits, most * way, least) - least)


def fastest_snaps(description: RobotDescription, move: Move, reference: Floats) -> Floats:
    """Largest |s⁗| in each tick of a motion for which the drives have torque enough, shape (T,) [rad/s⁴].

    Args:
        description: The arm.
        move: The move.
        reference: The motion, shape (T, n) [rad].
    """
    payload, drives = body(paper_payload(description, move.mass)), description.drives
    rigid, flexible = rigid_model(description, payload), flexible_model(description, payload)
    own, bent = rigid.createData(), flexible.model.createData()
    limit, rotor = np.array(description.limits.torque), np.array(drives.rotor_inertia)
    along = (reference[-1] - reference[0]) / np.abs(reference[-1] - reference[0]).max()
    qd, qdd = np.gradient(reference, PERIOD, axis=0), np.zeros_like(reference)
    qdd[1:-1] = np.diff(reference, 2, axis=0) / PERIOD**2
    found = np.empty(len(reference))
    for k, q in enumerate(reference):
        needed = pin.rnea(rigid, own, q, qd[k], qdd[k]) + rotor * qdd[k]
        room = np.maximum(SHARE * limit - np.array(drives.coulomb_friction) - np.abs(needed), LEAST * limit)
        lead = _lead(flexible, bent, np.array(drives.gear_stiffness), q, along)
        found[k] = (room / np.maximum(rotor * np.abs(lead), 1e-12)).min()
    return found


def _lead(flexible: FlexibleModel, data: pin.Data, stiffness: Floats, q: Floats, along: Floats) -> Floats:
    """Lead of each joint for an acceleration of 1 along the way, shape (n,)."""
    model, joints, flexes = flexible.model, flexible.joints, flexible.flexes
    at, moved = np.zeros((2, model.nv))
    at[joints], moved[joints] = q, along
    load = pin.crba(model, data, at, pin.Convention.WORLD) @ moved
    jacobian = pin.computeFrameJacobian(model, data, at, flexible.flange, pin.LOCAL_WORLD_ALIGNED)[:3]
    J_j, J_f = jacobian[:, joints], jacobian[:, flexes]
    back = J_f @ (load[flexes] / flexible.flex_stiffness)
    lead: Floats = load[joints] / stiffness + J_j.T @ np.linalg.solve(
        J_j @ J_j.T + DAMPED**2 * np.eye(3), back
    )
    return lead


def _least(way: float, limits: MotionLimits, most: Floats, enough: int) -> int:
    """Least number of ticks, at least `enough`, of a motion whose |s⁗| keeps a limit at each share of its time."""
    return fewest(max(enough, 5), lambda ticks: _farthest(ticks, limits, most) >= way * (1.0 - SLACK))


def _farthest(ticks: int, limits: MotionLimits, most: Floats) -> float:
    """Longest way from rest to rest in a number of ticks [rad], a linear programme in the velocities of the ticks."""
    K = ticks - 2
    first = diags([1.0, -1.0], [0, -1], (K + 1, K), "csr")
    second = diags([1.0, -1.0], [0, -1], (K + 2, K + 1), "csr") @ first
    third = diags([1.0, -1.0], [0, -1], (K + 3, K + 2), "csr") @ second
    at = np.interp(np.linspace(0.0, 1.0, K + 3), np.linspace(0.0, 1.0, len(most)), most)
    rows, bounds = [first, second], [
        np.full(K + 1, limits.acceleration * PERIOD), np.full(K + 2, limits.jerk * PERIOD**2),
    ]  # fmt: skip
    if np.isfinite(at).all():
        rows.append(third)
        bounds.append(at * PERIOD**3)
    sides = vstack(rows)
    found = linprog(
        -np.ones(K), A_ub=vstack([sides, -sides]), b_ub=np.tile(np.concatenate(bounds), 2),
        bounds=(0.0, limits.velocity), method="highs",
    )  # fmt: skip
    return -float(found.fun) * PERIOD if found.success else 0.0
