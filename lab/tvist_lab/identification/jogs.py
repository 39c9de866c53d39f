"""Plan and make jogs: choose the most informative ones, find free ways to them, and record their ring-downs.

A robot that takes only positions follows with a servo's lag, so its set-points still move when the reference
has stopped. To find that lag, a turn of the last joint, which hardly bends, is recorded first. The fit of the
ring-downs then includes the lag as known poles.
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
    CollisionModel,
    InverseDynamics,
    JointLine,
    MotionLimits,
    body,
    quickest_motion,
)
from tvist_lab.collect import collect
from tvist_lab.identification.design import LIMITS, choose, free_configurations, jog_of
from tvist_lab.identification.friction import identify_friction
from tvist_lab.identification.ring_downs import (
    BEGINS,
    IdentificationError,
    Log,
    Progress,
    check_model,
    stops_of,
)
from tvist_lab.identification.servo_response import ServoResponse, servo_response
from tvist_lab.identification.travel import WAYS, Travel, quickness, slower, unless_collision
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import ModalParameter
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.values import Payload

RING_DOWNS = 12
MIN_RING_DOWNS = 4  # smallest useful number of ring-downs; with fewer, the model would be mostly guesses
MAX_CHOSEN = 37  # most ring-downs that are chosen for their information; if more are wanted, all are spread
CANDIDATES = 60  # smallest number of configurations to choose from
CANDIDATES_PER_JOG = 3  # number of candidates for each jog, since ways to some of them may collide
CHECK_STEP = 0.03  # step of the fastest joint between postures at which a way is checked [rad]
GENTLEST = 0.4  # smallest speed of a jog relative to that with `LIMITS` [-]
FIRST = 0.55  # speed of the first jog relative to the largest that the torque limits permit [-]
LOUD, LATER = 0.15, 0.1
"""Desired rms acceleration per axis, as after a program's motion [m/s²], and its time after the stop [s]."""
INEXACT, STICKING = 0.03, 0.2  # share of a ring-down that no model explains [-], normally and if motors stick
STICKS = 1.5  # ratio of breakaway to moving friction above which a motor counts as sticking [-]
GENTLE = 1.0  # acceleration on the ways of a robot that takes only positions [rad/s²]
TURN, TURNS = 0.1, 2  # angle of the turns of the last joint that find the lag [rad], and their number
UNKNOWN = 0.15  # time after the stop that is ignored if the lag is unknown [s]
PAUSE, AFTER = 0.3, 0.6  # rest before a jog, and time recorded after it [s]


@dataclass(frozen=True)
class Jog:
    """A short move that excites a ring-down, and a way to its start that is free of collision."""

    payload: int
    way: tuple[Floats, ...]
    """Postures to pass one after the other, ending at the jog's start, each of shape (n,) [rad]."""
    q: Floats  # end of the jog, where the arm vibrates, shape (n,) [rad]
    limits: MotionLimits


@dataclass(frozen=True)
class JogPlan:
    """Moves of a robot, checked for collisions with itself and the floor."""

    arm: ArmModes  # the robot file's arm with the carried payloads
    at: Floats  # present joint angles, shape (n,) [rad]
    jogs: tuple[Jog, ...]
    ways: MotionLimits  # limits of all other moves
    seed: int
    changed: bool  # whether the payload of a simulated arm changes between jogs
    turned: Floats | None
    """Target of the last joint's turn if the robot takes only positions, shape (n,) [rad]; else None."""

    @property
    def speed(self) -> float:
        """Speed of the fastest joint [rad/s]."""
        return max(self.ways.velocity, *(jog.limits.velocity for jog in self.jogs))

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        rests, at, moves = len(self.jogs) + (0 if self.turned is None else 2 * TURNS), self.at, []
        for jog in self.jogs:
            moves += [(*ends, self.ways) for ends in pairwise([at, *jog.way])]
            moves.append((jog.way[-1], jog.q, jog.limits))
            at = jog.q
        lasting = (quickest_motion(JointLine(a, b), limits).duration for a, b, limits in moves)
        return sum(lasting, rests * (PAUSE + AFTER))


@dataclass(frozen=True)
class RingDownLogs:
    """Data of jogs or logs for an identification."""

    logs: tuple[Log, ...]
    friction: tuple[ModalParameter, ...] = ()
    no_friction: str = "it is measured in a slow sweep of a served robot"
    """Why friction was not measured; empty if it was."""
    seed: int | None = None  # seed of the choice of jogs; None if there was none
    refused: int = 0  # number of jogs that the robot refused because of a collision
    servo: ServoResponse | None = None  # lag of a robot that takes only positions
    seconds: float = 0.0  # robot time that the measurement took [s]


async def plan_jogs(
    robot: Robot,
    description: RobotDescription,
    ring_downs: int = RING_DOWNS,
    *,
    payloads: tuple[Payload, ...] = (),
    seed: int = 0,
    positions: bool = False,
) -> JogPlan:
    """Choose the most informative jogs, with free ways from the present configuration.

    `payloads` are those a simulated arm carries in turn; by default it is the declared one. `positions`: the robot
    takes only positions. Raises IdentificationError if ring-downs or ways are too few or the file does not fit.
    """
    info, state = await robot.info(), await robot.state()
    check_model(info, description)
    carried = payloads or (info.payload,)
    least = max(MIN_RING_DOWNS, len(carried))
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
        candidates = free_configurations(
            description, carried, max(CANDIDATES, CANDIDATES_PER_JOG * ring_downs), seed, at
        )
        counts = [len(range(number, ring_downs, len(carried))) for number in range(len(carried))]
        jogs = plan_ways(arm, candidates, at, counts)
        turned = at + TURN * np.eye(len(at))[-1] * (-1.0 if at[-1] > 0.0 else 1.0) if positions else None
        free = turned is None or is_free(CollisionModel(description, body(carried[0])), at, turned)
        if len(jogs) < ring_downs or not free:
            raise IdentificationError(
                f"from where the arm stands, {len(jogs)} of {ring_downs} configurations can be reached without "
                "touching itself or the floor: move it to where it has more room, or ask for fewer ring-downs"
            )
        slow = (replace(jog.limits, velocity=min(jog.limits.velocity, speed)) for jog in jogs)
        capped = tuple(replace(jog, limits=limits) for jog, limits in zip(jogs, slow, strict=True))
        return JogPlan(arm, at, capped, ways, seed, bool(payloads), turned)

    return await asyncio.to_thread(planned)


def plan_ways(
    arm: ArmModes,
    candidates: Sequence[Floats],
    at: Floats,
    counts: Sequence[int],
    known: tuple[Floats, Floats] | None = None,
) -> list[Jog]:
    """Choose the most informative jogs per payload and find ways to them; leave out jogs without a free way.

    `known` holds the logarithms of the parameters and their covariance; None means the guess.
    """
    order = [(number, payload) for number in range(len(candidates)) for payload in range(len(counts))]
    if sum(counts) <= MAX_CHOSEN:
        order = choose(arm, candidates, [CANDIDATES_PER_JOG * count for count in counts], known)
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
            # If a drive saturated, the ring-down would not be free vibration.
            share = quickness(dynamics, start, q, LIMITS, torque)
            if way is not None and share >= GENTLEST:
                found.append(Jog(payload, way, q, slower(LIMITS, share)))
                here = q
    return found


def is_free(collisions: CollisionModel, *postures: Floats) -> bool:
    """Whether the straight ways between postures, in joint space, are free of collision."""
    for before, after in pairwise(postures):
        steps = max(int(np.ceil(np.max(np.abs(after - before)) / CHECK_STEP)), 1)
        if any(
            collisions.meeting(before + (after - before) * k / steps) is not None for k in range(steps + 1)
        ):
            return False
    return True


async def make_jogs(robot: Robot, control: Arm, plan: JogPlan, progress: Progress) -> RingDownLogs:
    """Measure friction in a slow motion, then make jogs, each just strong enough for a clear ring-down."""
    # If the robot takes only positions, its torques are unknown: instead of the slow motion, turn its last
    # joint to find its lag.
    info, began = await robot.info(), (await robot.state()).tick
    await control.set_shaper("none")
    found = RingDownLogs((), seed=plan.seed)
    try:
        if plan.turned is not None:
            progress("turning the last joint")
            quick = max((jog.limits for jog in plan.jogs), key=lambda limits: limits.acceleration)
            turns = [await _recorded(robot, control, q, quick) for q in (plan.turned, plan.at) * TURNS]
            found = replace(found, servo=servo_response(turns))
        else:
            progress("sweeping for friction")
            places = [jog.q for jog in plan.jogs]
            try:
                friction = await identify_friction(robot, control, plan.arm.description, places)
                found = replace(found, friction=friction, no_friction="")
            except IdentificationError as error:  # springs can be measured without the friction
                found = replace(found, no_friction=str(error))
        logs = await _jogs(robot, control, plan, info, found, progress)
    finally:
        if plan.changed:
            with contextlib.suppress(ClientError, RefusedError):
                await _carry(control, info.payload)
    seconds = PERIOD * ((await robot.state()).tick - began)
    return replace(found, logs=tuple(logs), refused=len(plan.jogs) - len(logs), seconds=seconds)


async def _jogs(
    robot: Robot, control: Arm, plan: JogPlan, info: Info, known: RingDownLogs, progress: Progress
) -> list[Log]:
    """Return the recordings of all jogs that the robot did not refuse."""
    servo = known.servo
    sticks = any(
        one.quantity == "breakaway" and one.status == "identified" and one.value > STICKS
        for one in known.friction
    )
    inexact = STICKING if sticks else INEXACT
    begins = BEGINS if plan.turned is None else UNKNOWN if servo is None else servo.delay
    driven = () if servo is None else servo.poles
    logs, share, carried = list[Log](), FIRST, None
    for number, jog in enumerate(plan.jogs, 1):
        progress(f"ring-down {number} of {len(plan.jogs)}")
        payload = plan.arm.payloads[jog.payload]
        if plan.changed and payload != carried:
            await _carry(control, payload)
            carried = payload
        travel = Travel(robot, control, plan.arm.description, payload)
        recording = await unless_collision(_jogged(robot, control, travel, jog, plan.ways, share))
        if recording is None:
            continue
        logs.append(Log(f"jog {number}", replace(recording, info=info), payload, begins, inexact, driven))
        heard = stops_of(logs[-1:])[0][-1].ring_down
        loud = 0.0 if heard is None else heard.rms(LATER)
        share = float(np.clip(share * np.sqrt(LOUD / max(loud, 1e-3)), GENTLEST, 1.0))
    return logs


async def _jogged(
    robot: Robot, control: Arm, travel: Travel, jog: Jog, ways: MotionLimits, share: float
) -> Recording:
    for posture in jog.way:
        await travel.move(posture, ways)
    return await _recorded(robot, control, jog.q, slower(jog.limits, share))


async def _recorded(robot: Robot, control: Arm, q: Floats, limits: MotionLimits) -> Recording:
    """Make one move after a rest; record it with its ring-down."""
    with collect(robot) as collected:
        await robot.advance(round(PAUSE / PERIOD))
        await control.move_j(q, **asdict(limits))
        await robot.advance(round(AFTER / PERIOD))
    return collected.recording()


async def _carry(control: Arm, payload: Payload) -> None:
    """Put a payload on a simulated arm, and declare it."""
    await control.reset(payload=payload)
    await control.set_payload(payload.mass, payload.com, payload.inertia)
