"""Identify the payload from the arm's torques at rest in several poses, and check it in a short motion.

At rest, the motors balance gravity, which is linear in the payload's mass and first moment:

    τ - g(q) = Y(q) (m, m c),  g of the bare arm

Each pose is approached from both sides, so that friction acts in both directions. In motion, the same
quantities determine the torques beyond gravity; friction and rotors are estimated with them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import CollisionModel, body, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.design import most_informative
from tvist_lab.identification.ring_downs import IdentificationError, Progress, check_model
from tvist_lab.identification.travel import WAYS, Travel, unless_collision
from tvist_lab.identification.unknowns import ball, heavier
from tvist_lab.recordings import Floats, Recording
from tvist_lab.workspace import workspace
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import carries_weight, holding_torque, rigid_model
from tvist_protocol.values import Payload

POSES = 6
CANDIDATES = 60  # number of poses to choose from
ASIDE = 0.08  # distance from which each joint approaches a pose, on both sides [rad]
REST = 0.8  # time for the arm to come to rest in a pose [s]
LOOK = 0.2  # time over which torques are averaged [s]
SWING = 0.5  # length of the short motion [rad]
BLOCK = 10  # number of ticks over which a motion's torques are averaged
MIN_POSES = 3
LEAST_ERROR = 0.01  # smallest assumed error of a torque, relative to the joint's friction [-]
ROTOR = 3.0  # largest assumed inertia of a rotor [kg m^2]
DISAGREEMENT = (0.3, 4.0)
"""Masses found at rest and moving contradict if they differ by more than these kg and standard deviations."""
CERTAIN = 4.0  # distance of a mass's bounds from the estimate, in standard deviations [-]
LIGHT = 0.1  # mass below which the centre of mass is not reported [kg]


@dataclass(frozen=True)
class PayloadFound:
    """Mass and centre of mass, with their accuracy."""

    payload: Payload  # payload to declare; its inertia is that of a steel ball of the same mass
    mass_deviation: float  # standard deviation of the mass [kg]
    com_deviation: tuple[float, ...]  # standard deviation of each coordinate [m]
    mass_in_motion: float  # mass according to the short motion [kg]
    mass_in_motion_deviation: float  # standard deviation of that mass [kg]
    declared: Payload
    poses: int


async def identify_payload(
    robot: Robot, control: Arm, description: RobotDescription, *, seed: int = 0, progress: Progress
) -> PayloadFound:
    """Identify the payload as a client; raise IdentificationError if the arm or its poses do not allow it."""
    info = await robot.info()
    check_model(info, description)
    if not carries_weight(description):
        raise IdentificationError(
            f"no joint of a {info.model} carries weight, so its torques at rest do not depend on the payload: weigh it"
        )
    arm = _Regressor(description)
    period = 1.0 / info.rate_hz
    payloads = (info.payload, paper_payload(description, description.limits.payload))
    travel = Travel(robot, control, description, max(payloads, key=lambda payload: payload.mass))
    rows, torques, rested = [], [], list[Floats]()
    for q in arm.choose(_free(description, payloads, seed), 3 * POSES):
        if len(rested) == POSES:
            break
        held = await unless_collision(_hold(robot, travel, q, period))
        if held is None:
            continue
        at, torque = held
        rested.append(at)
        progress(f"pose {len(rested)} of {POSES}")
        rows.append(arm.static(at))
        torques.append(torque - arm.torque(at, np.zeros_like(at), np.zeros_like(at)))
    if len(rested) < MIN_POSES:
        raise IdentificationError(
            f"{len(rested)} of {POSES} poses could be reached, at least {MIN_POSES} are needed: give the arm more room"
        )
    matrix = np.vstack(rows)
    found, deviations = arm.solve(matrix, np.concatenate(torques))
    deviations = np.hypot(deviations, arm.of_masses(matrix, rested))
    progress("a short motion")
    in_motion, in_motion_deviation = arm.move(await _swing(robot, travel, q, period))
    mass = max(float(found[0]), 0.0)
    apart = abs(in_motion - mass)
    if apart > DISAGREEMENT[0] + DISAGREEMENT[1] * math.hypot(deviations[0], in_motion_deviation):
        raise IdentificationError(
            f"at rest the arm seems to carry {mass:.2f} kg, in motion {in_motion:.2f} kg: it touches something, or the "
            "torques are not those of its motors"
        )
    # A payload above the rating cannot be declared; a mass that is not significantly above is set to the rating.
    rated = info.limits.payload
    if rated < mass < rated + CERTAIN * float(deviations[0]):
        mass = rated
    com = found[1:] / mass if mass >= LIGHT else np.zeros(3)
    spread = np.hypot(deviations[1:], com * deviations[0]) / mass if mass >= LIGHT else np.full(3, np.inf)
    return PayloadFound(
        payload=Payload(mass=mass, com=tuple(com.tolist()), inertia=ball(mass)),
        mass_deviation=float(deviations[0]),
        com_deviation=tuple(spread.tolist()),
        mass_in_motion=in_motion,
        mass_in_motion_deviation=in_motion_deviation,
        declared=info.payload,
        poses=len(rested),
    )


class _Regressor:
    """Torques that a payload adds, linear in its mass and first moment."""

    def __init__(self, description: RobotDescription) -> None:
        self._bare = rigid_model(description, Body())
        self._data = self._bare.createData()
        places = ((0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
        self._models = [rigid_model(description, Body(mass=1.0, com=(x, y, z))) for x, y, z in places]
        self._heavier = [rigid_model(*one) for one in heavier(description, Body())[:-1]]
        friction = np.array(description.drives.coulomb_friction)
        self._friction = np.maximum(friction, 0.01 * np.array(description.limits.torque))
        self._width = description.drives.friction_width

    def static(self, q: Floats) -> Floats:
        """Return Y(q), shape (n, 4)."""
        return self.dynamic(q, np.zeros_like(q), np.zeros_like(q))

    def dynamic(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return Y(q, q̇, q̈) without the payload's inertia about the flange, shape (n, 4)."""
        # Two point masses, 1 m to either side of the flange, have equal inertia. Half the difference of their
        # torques therefore contains the first moment alone.
        none = self.torque(q, qd, qdd)
        mass, *sides = (np.array(pin.rnea(m, m.createData(), q, qd, qdd)) for m in self._models)
        halves = (0.5 * (there - back) for there, back in zip(sides[::2], sides[1::2], strict=True))
        return np.column_stack([mass - none, *halves])

    def torque(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """Return τ without payload, shape (n,) [N m]."""
        return np.array(pin.rnea(self._bare, self._data, q, qd, qdd))

    def choose(self, candidates: Sequence[Floats], count: int) -> list[Floats]:
        """Choose the poses with most information about mass and centre of mass, the best first."""
        rows = (self.static(q) / self._friction[:, None] for q in candidates)
        says = {(number, 0): row.T @ row for number, row in enumerate(rows)}
        chosen = most_informative(np.diag([1e-2, 1.0, 1.0, 1.0]), says, [count])
        return [candidates[number] for number, _ in chosen]

    def solve(self, rows: Floats, torques: Floats) -> tuple[Floats, Floats]:
        """Estimate (m, m c) by weighted least squares, with standard deviations from the residual."""
        weight = np.tile(1.0 / self._friction, len(torques) // len(self._friction))
        return _least_squares(rows * weight[:, None], torques * weight)

    def of_masses(self, rows: Floats, poses: Sequence[Floats]) -> Floats:
        """Return standard deviations of (m, m c) due to errors of link masses, see `LINK_MASS`, shape (4,).

        `rows` are Y of all k poses, shape (n k, 4).
        """
        weight = np.tile(1.0 / self._friction, len(poses))
        solved = np.linalg.pinv(rows * weight[:, None])
        bare = np.concatenate([holding_torque(self._bare, q) for q in poses])
        moved = [
            solved @ (weight * (np.concatenate([holding_torque(model, q) for q in poses]) - bare))
            for model in self._heavier
        ]
        return np.asarray(np.sqrt(np.sum(np.square(moved), axis=0)))

    def move(self, recording: Recording) -> tuple[float, float]:
        """Estimate the mass and its standard deviation from a motion [kg]."""
        # The first moment and each joint's friction and rotor inertia are estimated as well.
        q, qd, qdd = (recording[f"target_{name}"] for name in ("q", "qd", "qdd"))
        moment = recording["actual_moment"]
        moving = np.flatnonzero(np.abs(qd).max(axis=1) > 1e-3)
        blocks = np.array_split(moving, max(len(moving) // BLOCK, 1))
        n = q.shape[1]
        rows, torques = [], []
        for block in blocks:
            own = np.mean([np.tanh(qd[block] / self._width), qd[block], qdd[block]], axis=1)
            added = np.mean([self.dynamic(q[row], qd[row], qdd[row]) for row in block], axis=0)
            rest = [moment[row] - self.torque(q[row], qd[row], qdd[row]) for row in block]
            rows.append(np.hstack([added, *(np.diag(part) for part in own)]))
            torques.append(np.mean(rest, axis=0))
        matrix, right = np.vstack(rows), np.concatenate(torques)
        weight = np.tile(1.0 / self._friction, len(blocks))
        # A weak prior from the largest plausible rotors and friction, since a short motion does not distinguish all
        # of them.
        largest = np.concatenate([self._friction, self._friction / self._width, np.full(n, ROTOR)])
        prior = np.hstack([np.zeros((3 * n, 4)), np.diag(1.0 / largest)])
        matrix = np.vstack([matrix * weight[:, None], prior])
        found, deviations = _least_squares(matrix, np.concatenate([right * weight, np.zeros(3 * n)]))
        return float(found[0]), float(deviations[0])


def _least_squares(matrix: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Return the solution, and its standard deviations from the residual."""
    found, *_ = np.linalg.lstsq(matrix, right)
    freedom = max(len(right) - matrix.shape[1], 1)
    variance = max(float(np.sum((right - matrix @ found) ** 2)) / freedom, LEAST_ERROR**2)
    return np.asarray(found), np.asarray(np.sqrt(np.diag(np.linalg.pinv(matrix.T @ matrix)) * variance))


def _free(description: RobotDescription, payloads: Sequence[Payload], seed: int) -> list[Floats]:
    """Return poses with varied wrists that are free of collision with every payload."""
    joints = description.joints
    models = [CollisionModel(description, body(payload)) for payload in payloads]
    rng = np.random.default_rng(seed)
    found: list[Floats] = []
    for q in workspace(description, ASIDE).random(20 * CANDIDATES, joints, seed):
        if len(found) == CANDIDATES:
            break
        q[0] *= 0.25
        q[4:] = rng.uniform(-np.pi / 2.0, np.pi / 2.0, joints - 4) if joints > 4 else []
        if all(model.meeting(end) is None for model in models for end in (q, q - ASIDE, q + ASIDE)):
            found.append(q)
    return found


async def _hold(robot: Robot, travel: Travel, q: Floats, period: float) -> tuple[Floats, Floats]:
    """Return angles and torques at rest in a pose, averaged over approaches from both sides."""
    rested = []
    for side in (-1.0, 1.0):
        await travel.reach(q + side * ASIDE)
        await travel.move(q, replace(WAYS, acceleration=1.0))
        await robot.advance(round(REST / period))
        with collect(robot) as collected:
            await robot.advance(round(LOOK / period))
        recording = collected.recording()
        rested.append([recording[name].mean(axis=0) for name in ("actual_q", "actual_moment")])
    angles, torques = np.mean(rested, axis=0)
    return angles, torques


async def _swing(robot: Robot, travel: Travel, q: Floats, period: float) -> Recording:
    """Move there and back on a collision-free straight line, and record the motion."""
    swing = np.zeros_like(q)
    swing[1:4] = SWING
    for share in (1.0, 0.5, 0.25, -0.25, -0.5):
        with collect(robot) as collected:
            if await unless_collision(travel.move(q + share * swing)) is None:
                continue
            await travel.move(q)
            await robot.advance(round(LOOK / period))
        return collected.recording()
    raise IdentificationError("no short motion is free of collisions: give the arm more room")
