"""Jogs of a robot: a plan of those that tell most, with free ways to them, and the recordings of their ring-downs.

A robot that takes positions alone follows with a servo's lag, so that its set-points still come to rest when ours have
stopped: the lag is found first, from a turn of the last joint, which hardly bends. Its ring-downs then hold that motion
with known poles.
"""

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_controller.api.line import (
    REBOUND,
    CollisionModel,
    InverseDynamics,
    JointLine,
    MotionLimits,
    acceleration_on_way,
    body,
    quickest_motion,
)
from tvist_lab.collect import collect
from tvist_lab.identification.design import LIMITS, choose, free_configurations, jog_of
from tvist_lab.identification.friction import identify_friction
from tvist_lab.identification.ring_downs import BEGINS, IdentificationError, Log, Progress, stops_of
from tvist_lab.identification.servo_response import ServoResponse, servo_response
from tvist_lab.identification.travel import or_none
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import ModalParameter
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.values import Payload

RING_DOWNS = 12
LEAST = 4
"""Number of ring-downs below which the model consists of little more than its guesses."""
FEW = 37
"""Largest number of ring-downs that are chosen as the most informative; more are spread over the workspace."""
CANDIDATES = 60
"""Least number of configurations to choose from."""
SPARE = 3
"""Number of candidates for each jog, since the way to some is not free."""
STEP = 0.03
"""Angle of the fastest joint between two postures in which a way is checked [rad]."""
GENTLEST = 0.4
"""Smallest quickness of a jog over the quickest one's [-]."""
FIRST = 0.55
"""Quickness of the first jog over what its torques permit, since nobody knows how loud the arm rings [-]."""
LOUD, LATER = 0.15, 0.1
"""Rms of the acceleration per axis to aim at, as after a program's motion [m/s^2], so much later than the stop [s]."""
INEXACT, STICKING = 0.03, 0.2
"""Share of a ring-down after a jog that no model explains [-], also of an arm whose motors stick."""
STICKS = 1.5
"""Friction at break-away over that in motion from which on a motor sticks [-]."""
WAYS = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""Limits of the ways to the jogs."""
GENTLE = 1.0
"""Acceleration of the ways of a robot that takes positions alone [rad/s²]."""
TURN, TURNS = 0.1, 2
"""Angle by which its last joint turns there and back to show the lag [rad], and how often."""
UNKNOWN = 0.15
"""Time after the stop that a ring-down leaves out where the lag is not known [s]."""
PAUSE, AFTER = 0.3, 0.6
"""Rest before a jog, and time recorded after it [s]."""


@dataclass(frozen=True)
class Jog:
    """A short move after which the arm rings, and free ways to its start."""

    payload: int
    """Index of the payload that the arm carries."""
    way: tuple[Floats, ...]
    """Postures to go to one after the other, the last of which is the jog's start, each of shape (n,) [rad]."""
    q: Floats
    """End of the jog, where the arm rings, shape (n,) [rad]."""
    limits: MotionLimits


@dataclass(frozen=True)
class JogPlan:
    """Moves of a robot, checked for collisions with itself and the floor."""

    arm: ArmModes
    """The robot file's arm, with the payloads that it carries."""
    at: Floats
    """Present joint angles, shape (n,) [rad]."""
    jogs: tuple[Jog, ...]
    """The jogs, one after the other."""
    ways: MotionLimits
    """Limits of all other moves."""
    seed: int
    """Seed of the choice."""
    changed: bool
    """Whether the payload of a simulated arm changes between jogs."""
    turned: Floats | None
    """Where the last joint of a robot that takes positions alone turns to, shape (n,) [rad]; None for others."""

    @property
    def speed(self) -> float:
        """Speed of the fastest joint [rad/s]."""
        return max(self.ways.velocity, *(jog.limits.velocity for jog in self.jogs))

    @property
    def seconds(self) -> float:
        """Time that it takes [s]."""
        found, at = (0.0 if self.turned is None else 2 * TURNS * (PAUSE + AFTER)), self.at
        for jog in self.jogs:
            for ends in pairwise([at, *jog.way]):
                found += quickest_motion(JointLine(*ends), self.ways, PERIOD).duration
            found += (
                quickest_motion(JointLine(jog.way[-1], jog.q), jog.limits, PERIOD).duration + PAUSE + AFTER
            )
            at = jog.q
        return found


@dataclass(frozen=True)
class Measured:
    """What a source of ring-downs gives: jogs of a robot, or logs."""

    logs: tuple[Log, ...]
    """Recordings with stops."""
    friction: tuple[ModalParameter, ...] = ()
    """Friction of the joints, if it was measured."""
    no_friction: str = "it is measured in a slow sweep of a served robot"
    """Why it was not; empty if it was."""
    seed: int | None = None
    """Seed of the choice of jogs; None if nothing was chosen."""
    refused: int = 0
    """Number of jogs that the robot refused because of a collision."""
    servo: ServoResponse | None = None
    """Lag with which a robot that takes positions alone follows; None if it follows in another way."""
    seconds: float = 0.0
    """Time of the robot that it took [s]."""


async def plan_jogs(
    robot: Robot,
    description: RobotDescription,
    ring_downs: int = RING_DOWNS,
    *,
    payloads: tuple[Payload, ...] = (),
    seed: int = 0,
    positions: bool = False,
) -> JogPlan:
    """Choose the jogs that tell most, with free ways from where the arm stands.

    Args:
        robot: The robot, whose limits hold.
        description: The robot file.
        ring_downs: Number of jogs.
        payloads: Payloads that a simulated arm carries one after the other; empty for the declared one.
        seed: Seed of the candidates.
        positions: Whether the robot takes positions alone.

    Raises:
        IdentificationError: There are too few ring-downs or free ways, or the file is another robot's.
    """
    info, state = await robot.info(), await robot.state()
    if info.model != description.robot.model:
        raise IdentificationError(
            f"the robot is a {info.model}, its description of a {description.robot.model}: name its file"
        )
    carried = payloads or (info.payload,)
    least = max(LEAST, len(carried))
    if ring_downs < least:
        raise IdentificationError(
            f"{ring_downs} ring-downs with {len(carried)} payloads are too few for springs and drives: "
            f"at least {least} are needed, {RING_DOWNS} are recommended"
        )
    speed = min(info.limits.velocity)
    ways = replace(WAYS, velocity=min(WAYS.velocity, speed))
    if positions:
        ways = replace(ways, acceleration=GENTLE, jerk=LIMITS.jerk)

    def planned() -> JogPlan:
        at, arm = np.array(state.target_q), ArmModes(description, carried)
        candidates = free_configurations(description, carried, max(CANDIDATES, SPARE * ring_downs), seed, at)
        counts = [len(range(number, ring_downs, len(carried))) for number in range(len(carried))]
        jogs = plan_ways(arm, candidates, at, counts)
        turned = at + TURN * np.eye(len(at))[-1] * (-1.0 if at[-1] > 0.0 else 1.0) if positions else None
        free = turned is None or is_free(CollisionModel(description, body(carried[0])), at, turned)
        if len(jogs) < ring_downs or not free:
            raise IdentificationError(
                f"from where the arm stands, {len(jogs)} of {ring_downs} configurations can be reached without "
                "touching itself or the floor: move it to where it has more room, or ask for fewer ring-downs"
            )
        capped = [replace(jog.limits, velocity=min(jog.limits.velocity, speed)) for jog in jogs]
        slow = tuple(replace(jog, limits=limits) for jog, limits in zip(jogs, capped, strict=True))
        return JogPlan(arm, at, slow, ways, seed, bool(payloads), turned)

    return await asyncio.to_thread(planned)


def plan_ways(
    arm: ArmModes,
    candidates: Sequence[Floats],
    at: Floats,
    counts: Sequence[int],
    known: tuple[Floats, Floats] | None = None,
) -> list[Jog]:
    """Choose the jogs that would tell most, the most informative first with each payload, and find ways to them.

    Fewer than the counts are returned where the ways to others are not free. What is known are the logarithms of the
    parameters and their covariance; None stands for the guess.
    """
    order = [(number, payload) for number in range(len(candidates)) for payload in range(len(counts))]
    if sum(counts) <= FEW:
        order = choose(arm, candidates, [SPARE * count for count in counts], known)
    here, joints, torque = at, arm.description.joints, np.array(arm.description.limits.torque)
    upright = here * np.array([joint not in (1, 2, 3) for joint in range(joints)])
    upright[[joint for joint in (1, 3) if joint < joints]] = -np.pi / 2
    found: list[Jog] = []
    for payload, count in enumerate(counts):
        collisions = CollisionModel(arm.description, body(arm.payloads[payload]))
        dynamics = InverseDynamics(arm.description, body(arm.payloads[payload]))
        past = len(found) + count
        for q in (candidates[number] for number, carried in order if carried == payload):
            if len(found) == past:
                break
            start = q - jog_of(joints)
            way = next((w for w in ((start,), (upright, start)) if is_free(collisions, here, *w, q)), None)
            quickness = _quickness(dynamics, start, q, torque)
            if way is not None and quickness >= GENTLEST:
                found.append(Jog(payload, way, q, slower(LIMITS, quickness)))
                here = q
    return found


def slower(limits: MotionLimits, quickness: float) -> MotionLimits:
    """Return the limits of a motion that takes longer by 1 / quickness."""
    return MotionLimits(
        quickness * limits.velocity, quickness**2 * limits.acceleration, quickness**3 * limits.jerk
    )


def _quickness(dynamics: InverseDynamics, start: Floats, end: Floats, torque: Floats) -> float:
    """Return the largest share, up to 1, of a jog's quickness with which the arm rings within its torques.

    A drive at its limit would spoil the ring-down.
    """
    line = JointLine(start, end)
    room = acceleration_on_way(dynamics, line, start, end - start, LIMITS.velocity, torque)
    return min(1.0, float(np.sqrt(room / (1.0 + REBOUND) / LIMITS.acceleration)))


def is_free(collisions: CollisionModel, *postures: Floats) -> bool:
    """Return whether the straight ways from posture to posture, in the space of the joints, are clear."""
    for before, after in pairwise(postures):
        steps = max(int(np.ceil(np.max(np.abs(after - before)) / STEP)), 1)
        if any(
            collisions.meeting(before + (after - before) * k / steps) is not None for k in range(steps + 1)
        ):
            return False
    return True


async def make_jogs(robot: Robot, control: Arm, plan: JogPlan, progress: Progress) -> Measured:
    """Sweep slowly for friction, and make the jogs, each as gentle as makes the arm ring loudly enough.

    A robot that takes positions alone turns its last joint instead, which tells its lag: its torques are a guess.

    Args:
        robot: The robot, on a network or in process.
        control: The arm under control.
        plan: The moves.
        progress: Called before each step with what it does.
    """
    info, began = await robot.info(), (await robot.state()).tick
    await control.set_shaper("none")
    found = Measured((), seed=plan.seed)
    try:
        if plan.turned is not None:
            found = replace(found, servo=await _lag(robot, control, plan, progress))
        else:
            progress("sweeping for friction")
            places = [jog.q for jog in plan.jogs]
            try:
                friction = await identify_friction(robot, control, plan.arm.description, places)
                found = replace(found, friction=friction, no_friction="")
            except IdentificationError as error:  # springs can be measured all the same
                found = replace(found, no_friction=str(error))
        logs = await _jogs(robot, control, plan, info, found, progress)
    finally:
        if plan.changed:
            with contextlib.suppress(ClientError, RefusedError):
                await _carry(control, info.payload)
    seconds = PERIOD * ((await robot.state()).tick - began)
    return replace(found, logs=tuple(logs), refused=len(plan.jogs) - len(logs), seconds=seconds)


async def _lag(robot: Robot, control: Arm, plan: JogPlan, progress: Progress) -> ServoResponse | None:
    assert plan.turned is not None, "the plan is that of a robot that takes positions alone"
    progress("turning the last joint")
    quick = max((jog.limits for jog in plan.jogs), key=lambda limits: limits.acceleration)
    return servo_response([await _recorded(robot, control, q, quick) for q in (plan.turned, plan.at) * TURNS])


async def _jogs(
    robot: Robot, control: Arm, plan: JogPlan, info: Info, known: Measured, progress: Progress
) -> list[Log]:
    """Return the recordings of those jogs that the robot did not refuse."""
    servo = known.servo
    told = [one for one in known.friction if one.quantity == "breakaway" and one.status == "identified"]
    sticks = any(one.value > STICKS for one in told)
    inexact = STICKING if sticks else INEXACT
    begins = BEGINS if plan.turned is None else UNKNOWN if servo is None else servo.delay
    logs, share, carried = list[Log](), FIRST, None
    for number, jog in enumerate(plan.jogs, 1):
        progress(f"ring-down {number} of {len(plan.jogs)}")
        payload = plan.arm.payloads[jog.payload]
        if plan.changed and payload != carried:
            await _carry(control, payload)
            carried = payload
        recording = await or_none(_jogged(robot, control, jog, plan.ways, share))
        if recording is None:
            continue
        driven = () if servo is None else servo.poles
        logs.append(Log(f"jog {number}", replace(recording, info=info), payload, begins, inexact, driven))
        heard = stops_of(logs[-1:])[0][-1].ringing
        loud = 0.0 if heard is None else heard.rms_after(LATER)
        share = float(np.clip(share * np.sqrt(LOUD / max(loud, 1e-3)), GENTLEST, 1.0))
    return logs


async def _jogged(robot: Robot, control: Arm, jog: Jog, ways: MotionLimits, share: float) -> Recording:
    for posture in jog.way:
        await control.move_j(posture, **asdict(ways))
    return await _recorded(robot, control, jog.q, slower(jog.limits, share))


async def _recorded(robot: Robot, control: Arm, q: Floats, limits: MotionLimits) -> Recording:
    """Make one move after a rest, and record it with the ring-down after it."""
    with collect(robot) as collected:
        await robot.advance(round(PAUSE / PERIOD))
        await control.move_j(q, **asdict(limits))
        await robot.advance(round(AFTER / PERIOD))
    return collected.recording()


async def _carry(control: Arm, payload: Payload) -> None:
    """Make a simulated arm carry a payload, and declare it."""
    await control.reset(payload=payload)
    await control.set_payload(payload.mass, payload.com, payload.inertia)
