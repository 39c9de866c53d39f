"""Identification of a robot that takes positions alone: a plan of small moves, the moves, and what they tell.

Such a robot follows with a servo's lag, so that its set-points still come to rest when ours have stopped: the lag is
found first, from a turn of the last joint, which hardly bends. The ring-downs then hold that motion with known poles.
"""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise

import numpy as np
from msgspec.structs import replace as with_fields

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import CollisionModel, JointLine, MotionLimits, body, quickest_motion
from tvist_lab.collect import collect
from tvist_lab.identification.everyday_stops import CONTRADICTS, QUIET, Stop, noise_of
from tvist_lab.identification.from_logs import FromLogs, told_by
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.modal_calibration import Origin, contradicting
from tvist_lab.identification.modal_fit import softened
from tvist_lab.identification.modal_plan import LEAST, ModalPlan, check, free_configurations
from tvist_lab.identification.proposals import GENTLEST, Proposal, is_free, propose, slower
from tvist_lab.identification.ring_downs import PAUSE, Jog, Ringing
from tvist_lab.identification.servo_response import ServoResponse, fresh, servo_response
from tvist_lab.identification.unknowns import ArmModes, unknowns_near
from tvist_lab.metrics import motions
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Info

CANDIDATES = 60
"""Number of configurations to choose from."""
JOG = Jog(length=0.06, quickness=1.75)
"""The quickest jog: quicker than where no servo smooths it, so that the arm rings as after a program's motion."""
TURN = 0.1
"""Angle by which the last joint turns there and back to show the lag [rad]."""
TURNS = 2
"""How often it does so."""
GENTLE = 1.0
"""Acceleration of the ways [rad/s²]."""
AFTER = 0.6
"""Time recorded after a move [s]."""
FIRST = 0.55
"""Quickness of the first jog over what its torques permit, since nobody knows how loud the arm rings [-]."""
LOUD, LATER = 0.15, 0.1
"""Rms of the acceleration per axis to aim at, as after a program's motion [m/s^2], so much later than the stop [s]."""
INEXACT = 0.03
"""Share of a ring-down that no model explains [-]."""
UNKNOWN = 0.15
"""Time after the stop that a ring-down leaves out where the lag is not known [s]."""
LISTENED = 0.4
"""Length of a ring-down [s]."""


@dataclass(frozen=True)
class MovePlan:
    """Moves of a robot, checked for collisions with itself and the floor."""

    arm: ArmModes
    """The robot file's arm, with the payload that it carries."""
    at: Floats
    """Where it stands, shape (n,) [rad]."""
    turned: Floats
    """Where the last joint has turned, shape (n,) [rad]."""
    jogs: tuple[Proposal, ...]
    """The jogs, one after the other."""
    ways: MotionLimits
    """Limits of all other moves."""
    seed: int
    """Seed of the choice."""

    @property
    def speed(self) -> float:
        """Speed of the fastest joint [rad/s]."""
        return max(self.ways.velocity, *(jog.limits.velocity for jog in self.jogs))

    @property
    def seconds(self) -> float:
        """Time that it takes [s]."""
        found, at = 4.0 * (PAUSE + AFTER), self.at
        for jog in self.jogs:
            posts = [at, *jog.way]
            found += sum(
                quickest_motion(JointLine(*ends), self.ways, PERIOD).duration for ends in pairwise(posts)
            )
            found += (
                quickest_motion(JointLine(jog.way[-1], jog.q), jog.limits, PERIOD).duration + PAUSE + AFTER
            )
            at = jog.q
        return found


@dataclass(frozen=True)
class Positioned:
    """What the moves told."""

    found: FromLogs
    """Calibration and how far it goes."""
    servo: ServoResponse | None
    """The lag with which the robot follows; None if it follows in another way."""
    seconds: float
    """Time of the robot that it took [s]."""


async def plan_moves(robot: Robot, description: RobotDescription, plan: ModalPlan) -> MovePlan:
    """Choose the moves that tell most, with free ways from where the arm stands.

    Args:
        robot: The robot in front, whose limits hold.
        description: The robot file.
        plan: Number of ring-downs, seed and jog.

    Raises:
        IdentificationError: There are too few free ways, or the file is another robot's.
    """
    check(plan, 1)
    info, state = await robot.info(), await robot.state()
    if info.model != description.robot.model:
        raise IdentificationError(
            f"the robot is a {info.model}, its description of a {description.robot.model}: name its file"
        )
    return await asyncio.to_thread(_planned, description, info, np.array(state.target_q), plan)


def _planned(description: RobotDescription, info: Info, at: Floats, plan: ModalPlan) -> MovePlan:
    speed = min(info.limits.velocity)
    arm = ArmModes(description, (info.payload,), unknowns_near(description))
    candidates = free_configurations(description, arm.payloads, CANDIDATES, plan, at)
    turned = at + TURN * np.eye(len(at))[-1] * (-1.0 if at[-1] > 0.0 else 1.0)
    jogs = propose(arm, candidates, plan.jog, (at, 0), plan.ring_downs)
    if len(jogs) < plan.ring_downs or not is_free(
        CollisionModel(description, body(info.payload)), at, turned
    ):
        raise IdentificationError(
            f"from where the arm stands, {len(jogs)} of {plan.ring_downs} configurations can be reached without "
            "touching itself or the floor: move it to where it has more room, or ask for fewer ring-downs"
        )
    capped = tuple(
        replace(jog, limits=replace(jog.limits, velocity=min(jog.limits.velocity, speed))) for jog in jogs
    )
    ways = MotionLimits(speed, GENTLE, JOG.limits.jerk)
    return MovePlan(arm, at, turned, capped, ways, plan.seed)


@dataclass(frozen=True)
class Moved:
    """What was recorded of the moves."""

    info: Info
    """The robot in front."""
    jogs: tuple[Recording, ...]
    """One for each jog."""
    servo: ServoResponse | None
    """The lag with which the robot follows; None if it follows in another way."""
    seconds: float
    """Time of the robot that it took [s]."""


async def make_moves(robot: Robot, control: Arm, plan: MovePlan, progress: Callable[[str], None]) -> Moved:
    """Make the moves, each as gentle as makes the arm ring loudly enough.

    Args:
        robot: The robot in front.
        control: The arm under control.
        plan: The moves.
        progress: Called before each step with what it does.
    """
    info, began = await robot.info(), (await robot.state()).tick
    await control.set_shaper("none")
    quick = max((jog.limits for jog in plan.jogs), key=lambda limits: limits.acceleration)
    progress("turning the last joint")
    ways = (plan.turned, plan.at) * TURNS
    turns = [await _recorded(robot, control, q, quick) for q in ways]
    servo, jogs, share = servo_response(turns), list[Recording](), FIRST
    for number, jog in enumerate(plan.jogs, 1):
        progress(f"ring-down {number} of {len(plan.jogs)}")
        for posture in jog.way:
            await control.move_j(posture, **asdict(plan.ways))
        jogs.append(await _recorded(robot, control, jog.q, slower(jog.limits, share)))
        heard = _stop(number, jogs[-1], servo).ringing
        loud = 0.0 if heard is None else _rms_after(heard, LATER)
        share = float(np.clip(share * np.sqrt(LOUD / max(loud, 1e-3)), GENTLEST, 1.0))
    return Moved(info, tuple(jogs), servo, PERIOD * ((await robot.state()).tick - began))


def identify_moved(
    plan: MovePlan, moved: Moved, *, name: str, command: str, progress: Callable[[str], None]
) -> Positioned:
    """Fit springs and drives to what was recorded.

    Args:
        plan: The moves.
        moved: What was recorded of them.
        name: Name of the calibration.
        command: Command line that the user typed.
        progress: Called before each step with what it does.

    Raises:
        IdentificationError: Too few ring-downs can be used, or they contradict each other.
    """
    origin, servo = Origin(name, command, moved.info.model, plan.seed, moved.info.arm), moved.servo
    found = told(plan.arm, moved.jogs, servo, origin, progress)
    if servo is not None:
        calibration = with_fields(found.calibration, servo_lag_s=servo.lag, servo_gain=servo.gain)
        found = replace(found, calibration=calibration)
    return Positioned(found, servo, moved.seconds)


async def _recorded(robot: Robot, control: Arm, q: Floats, limits: MotionLimits) -> Recording:
    """Make one move after a rest, and record it with the ring-down after it."""
    with collect(robot) as collected:
        await robot.advance(round(PAUSE / PERIOD))
        await control.move_j(q, **asdict(limits))
        await robot.advance(round(AFTER / PERIOD))
    return collected.recording()


def told(
    arm: ArmModes,
    jogs: Sequence[Recording],
    servo: ServoResponse | None,
    origin: Origin,
    progress: Callable[[str], None],
) -> FromLogs:
    """Return what the ring-downs after jogs tell.

    Args:
        arm: The arm; it carried the first payload.
        jogs: Recordings of one jog each.
        servo: The lag; None if it is not known.
        origin: What the calibration says of its making.
        progress: Called before each step with what it does.

    Raises:
        IdentificationError: Too few can be used, or they contradict each other.
    """
    stops = [_stop(number, jog, servo) for number, jog in enumerate(jogs, 1)]
    ringings = [stop.ringing for stop in stops if stop.ringing is not None]
    if len(ringings) < LEAST:
        reasons = "; ".join(sorted({stop.reason for stop in stops if stop.ringing is None}))
        raise IdentificationError(
            f"{len(ringings)} of {len(stops)} ring-downs can be used, at least {LEAST} are needed: {reasons}"
        )
    progress("comparing ring-downs")
    stops, ringings = _softened(arm, stops)
    guilty = set(contradicting(arm, ringings))
    wrong = {id(ringings[number]) for number in guilty}
    stops = [
        replace(stop, ringing=None, reason=CONTRADICTS) if id(stop.ringing) in wrong else stop
        for stop in stops
    ]
    agreeing = [ringing for number, ringing in enumerate(ringings) if number not in guilty]
    return told_by(arm, stops, ringings[-1], agreeing, origin, progress)


def _rms_after(ringing: Ringing, late: float) -> float:
    """Rms of the acceleration per axis some time after the stop [m/s^2]."""
    assert ringing.time is not None, "rows have their times"
    return replace(ringing, force=ringing.force[ringing.time >= late]).rms


def _softened(arm: ArmModes, stops: Sequence[Stop]) -> tuple[list[Stop], list[Ringing]]:
    """Return stops and their ring-downs with the hysteresis of the gears that they tell."""
    ringings = softened(arm, [stop.ringing for stop in stops if stop.ringing is not None])
    left = iter(ringings)
    return [stop if stop.ringing is None else replace(stop, ringing=next(left)) for stop in stops], ringings


def _stop(number: int, jog: Recording, servo: ServoResponse | None) -> Stop:
    """Return the ring-down after a jog."""
    name, motion = "the robot", motions(jog)[-1]
    begin = jog.time[motion.shaped_stop] + (UNKNOWN if servo is None else servo.delay)
    seen = fresh(jog)
    rows = seen[(jog.time[seen] >= begin) & (jog.time[seen] < begin + LISTENED)]
    if len(rows) < 2 or jog.time[rows[-1]] - jog.time[rows[0]] < 0.5 * LISTENED:
        return Stop(name, number, None, "states were lost")
    force, time = jog["actual_tool_accelerometer"][rows], jog.time[rows] - jog.time[rows[0]]
    poles: tuple[complex, ...] = () if servo is None else servo.poles
    ringing = Ringing(
        jog["target_q"][motion.shaped_stop], 0, force, noise_of(jog, motion), time, driven=poles
    )
    if ringing.rms < QUIET * ringing.noise:
        return Stop(name, number, None, "the vibration does not stand out of the noise")
    return Stop(name, number, replace(ringing, inexact=INEXACT * ringing.rms))
