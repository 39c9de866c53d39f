"""Choose the few most informative jogs: greedy D-optimal design (Fedorov, 1972).

The guessed arm is simulated at many configurations; each ring-down gives an information matrix of the
parameters. Ring-downs are added one by one such that the determinant of the sum grows most.
"""

from collections.abc import Sequence
from itertools import islice

import numpy as np
import pinocchio as pin
from scipy.linalg import expm

from tvist_controller.api.line import CollisionModel, JointLine, MotionLimits, body, quickest_motion
from tvist_lab.identification.modal_fit import information
from tvist_lab.identification.ring_downs import BEGINS, LONGEST, RingDownData
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.values import Payload

LENGTH, SHARES = 0.06, (0.6, 0.6, 1.0)
"""Length of a jog for the fastest joint [rad]; shares of the joints from the base, so that every mode is excited."""
LIMITS = MotionLimits(velocity=2.6, acceleration=6.1, jerk=540.0)
"""Limits of the quickest jog: quicker than a client's `move_j`, so that an arm with a soft servo rings as well."""
SKIPPED, SAMPLES = round(BEGINS / PERIOD), round(LONGEST / PERIOD)
NOISE = 0.03  # assumed noise, rms per axis [m/s²]


def jog_of(joints: int) -> Floats:
    """Return the displacement of the joints in a jog, shape (joints,) [rad]."""
    jog = np.zeros(joints)
    used = min(joints, len(SHARES))
    jog[:used] = LENGTH * np.array(SHARES[:used])
    return jog


def free_configurations(
    description: RobotDescription,
    payloads: Sequence[Payload],
    count: int,
    seed: int,
    like: Floats | None = None,
) -> list[Floats]:
    """Return configurations that are free of collision at both ends of a jog, with every payload.

    Base and outer wrist joints, which hardly change the modes, are as in the configuration `like`, else zero.
    """
    joints = description.joints
    models = [CollisionModel(description, body(payload)) for payload in payloads]
    jog = jog_of(joints)
    aside = np.zeros(joints) if like is None else like * [joint not in (1, 2, 3) for joint in range(joints)]
    spread = identified(description, LENGTH).spread(20 * count, joints, seed) + aside
    ends = (q for q in spread if all(model.meeting(end) is None for model in models for end in (q, q - jog)))
    return list(islice(ends, count))


def choose(
    arm: ArmModes,
    candidates: Sequence[Floats],
    counts: Sequence[int],
    known: tuple[Floats, Floats] | None = None,
) -> list[tuple[int, int]]:
    """Choose ring-downs: return indices of candidates and payloads, the most informative first.

    `known` holds the logarithms of the parameters and their covariance; None means the guess.
    """
    at, covariance = (arm.guess, np.diag(arm.deviation**2)) if known is None else known
    says = {
        (number, payload): information(arm, predicted(arm, q, payload, at), at)
        for number, q in enumerate(candidates)
        for payload in range(len(arm.payloads))
        if counts[payload] > 0
    }
    return most_informative(np.asarray(np.linalg.inv(covariance), dtype=np.float64), says, counts)


def most_informative(
    knowledge: Floats, says: dict[tuple[int, int], Floats], counts: Sequence[int]
) -> list[tuple[int, int]]:
    """Return the keys of the most informative matrices, best first; of keys that end in k, `counts[k]`."""
    left, chosen = list(counts), list[tuple[int, int]]()
    while open_ := [key for key in says if key not in chosen and left[key[1]] > 0]:
        best = max(open_, key=lambda key: float(np.linalg.slogdet(knowledge + says[key])[1]))
        knowledge = knowledge + says[best]
        left[best[1]] -= 1
        chosen.append(best)
    return chosen


def predicted(arm: ArmModes, q: Floats, payload: int, logarithms: Floats | None = None) -> RingDownData:
    """Predict the ring-down after a jog; the arm is linearized at the jog's end, its feed-forward perfect."""
    flexible, mass = arm.flexible[payload], arm.mass(q, payload)
    drivetrain = arm.drivetrain(arm.guess if logarithms is None else logarithms)
    inertia, damping, stiffness = drivetrain.system(mass)
    N, L = len(inertia), len(mass)
    motors, joints = L + np.arange(N - L), flexible.joints
    system = np.zeros((2 * N, 2 * N))
    system[:N, N:] = np.eye(N)
    system[N:, :N], system[N:, N:] = (-np.linalg.solve(inertia, part) for part in (stiffness, damping))
    move = expm(PERIOD * system)
    forced = np.linalg.solve(system, (move - np.eye(2 * N))[:, N:]) @ np.linalg.inv(inertia)
    pushes = _pushes(drivetrain.rows[:, joints], mass[np.ix_(joints, joints)], jog_of(len(q)))
    full = np.zeros((len(pushes), N))
    full[:, motors] = pushes
    z, rates = np.zeros(2 * N), []
    for push in full:
        z = move @ z + forced @ push
        rates.append(system[N : N + L] @ z)
    data, at = flexible.model.createData(), np.zeros(flexible.model.nv)
    at[joints] = q
    jacobian = pin.computeFrameJacobian(flexible.model, data, at, flexible.flange, pin.LOCAL).reshape(6, -1)[
        :3
    ]
    force = np.array(rates[-SAMPLES:]) @ jacobian.T
    time: Floats = PERIOD * np.arange(len(force), dtype=np.float64)
    return RingDownData(q, payload, force, NOISE, time)


def _pushes(rows: Floats, rigid: Floats, jog: Floats) -> Floats:
    """Return the torques of the drives on their motors during and after a jog, shape (ticks, n) [N m]."""
    _, B, K_d, K_p, _ = rows
    motion = quickest_motion(JointLine(np.zeros_like(jog), jog), LIMITS)
    way = []
    while not motion.finished:
        way.append(motion.next())
    q = np.array([np.zeros_like(jog), *way, *[jog] * (SKIPPED + SAMPLES + 1)])
    qd = np.gradient(q, PERIOD, axis=0)
    return np.asarray(K_d * (qd + K_p * q) + np.gradient(qd, PERIOD, axis=0) @ (rigid + np.diag(B)))
