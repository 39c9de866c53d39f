"""Stops of every kind at random moments of accepted moves, compared with the same moves without a stop."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from tests.search import draws
from tests.search.draws import WITHIN
from tests.search.subject import CLIENT, SESSION, Subject, refused, speeds, torques

from tvist_controller.api.line import (
    CLEARANCE,
    TORQUE_SHARE,
    CollisionModel,
    JointLine,
    body,
    paper_payload,
    resting_after,
)
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c
from tvist_protocol.simulation import SimulationInject

EARLY = 17
"""Tick before which some moves are stopped, to test moves that have barely begun."""
BARELY, BARELY_WAY = 3e-3, 1e-3
"""A joint that moves no faster than this [rad/s] moves no farther than this when it is stopped [rad]."""
PAUSES = {"pause", "safeguard"}
"""Kinds of stops that slow down the motion's own time, through the filter."""
ROUNDING = 1e-9
"""Differences between positions below this are rounding errors [rad]."""
TORQUE_ROUNDING = 1e-3
"""Share by which a torque may exceed its bound between the moments that are checked in planning [-]."""
Halt = Callable[[Subject, np.random.Generator], object]

KINDS: dict[str, Halt] = {
    "plain": lambda robot, _: robot.send(c.Stop),
    "gentle": lambda robot, random: robot.send(c.Stop, deceleration=float(10 ** random.uniform(-2, 1))),
    "stranger's": lambda robot, _: robot.send(c.Stop, token=None, deceleration=1.0),
    "token gone": lambda robot, _: robot.controller.client_gone(CLIENT, SESSION),
    "lease over": lambda robot, _: robot.send(c.ReleaseControl),
    "power off": lambda robot, _: robot.send(c.PowerOff),
    "protective": lambda robot, _: robot.send(SimulationInject, fault="protective_stop"),
    "safeguard": lambda robot, _: robot.send(SimulationInject, fault="safeguard_stop"),
    "emergency": lambda robot, _: robot.send(SimulationInject, fault="emergency_stop"),
    "pause": lambda robot, _: robot.send(c.Pause),
}


@dataclass(frozen=True)
class Case:
    """One stop of one move."""

    seed: int
    kind: str
    start: Floats
    target: Floats
    mass: float
    shaper: str
    velocity: float
    acceleration: float
    jerk: float
    speed: float
    moment: int
    """Tick of the move at which it is stopped."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a stop; all deviations must be 0 or less."""

    case: Case
    ahead: float
    """Largest lead of the stop over the uninterrupted move [rad]."""
    off: float
    """Largest distance from the line [rad]."""
    late: int
    """Ticks by which it came to rest later."""
    torque: float
    """Share by which the rigid torque exceeded the larger of 90 % of the limit and the uninterrupted move's torque
    [-].
    """
    heavy: float
    """Share by which the rigid torque of the uninterrupted move exceeded a limit [-]."""
    speeds: tuple[float, float]
    """Largest velocity and acceleration of a joint, relative to its limits; must be `WITHIN` or less [-]."""
    near: float
    """How much the reference violated the clearance between two bodies [m]."""
    duration: float
    """Time from the stop until rest [s]."""
    told: tuple[float | None, float | None]
    """Duration [s] and way [rad] in the stop's event."""
    way: float
    """Angle that the leading joint turned after the stop [rad]."""
    speed: float
    """Velocity of the leading joint at the stop [rad/s]."""

    @property
    def kept(self):
        """Whether every figure is within its bound."""
        return (
            self.ahead <= ROUNDING
            and self.off <= ROUNDING
            and self.late <= 0
            and max(self.torque, self.heavy) <= TORQUE_ROUNDING
            and max(self.speeds) <= WITHIN
            and self.near <= 0.0
            and (self.speed > BARELY or self.way <= BARELY_WAY or self.case.kind in PAUSES)
        )


def draw(description, seed, kinds=tuple(KINDS)):
    """Return a case by its number; its move is one that the robot accepts."""
    random = np.random.default_rng([seed, 11])
    collisions = CollisionModel(description, body(paper_payload(description, 0.0)))
    while True:
        mass = draws.mass(description, random)
        collisions.declare(body(paper_payload(description, mass)))
        start, target = draws.postures(description, random, 2)
        if random.random() < 0.3:  # short moves without a cruise phase
            target = start + random.uniform(0.02, 0.3) * (target - start)
        if collisions.meeting(start) is None and collisions.on_way(JointLine(start, target).whole) is None:
            break
    case = Case(
        seed=seed,
        kind=str(random.choice(kinds)),
        start=start,
        target=target,
        mass=mass,
        shaper=draws.shaper(description, random),
        **draws.limits(description, random, slowest=0.4),
        speed=float(random.choice([1.0, 1.0, 1.0, random.uniform(0.1, 1.0)])),
        moment=0,
    )
    moved = resting_after(_left_alone(description, case))
    last = EARLY if random.random() < 0.1 else max(moved, 2)
    return Case(**{**vars(case), "moment": int(random.integers(1, last))})


def judge(description, case):
    """Stop the move, and compare it with the uninterrupted one."""
    payload = paper_payload(description, case.mass)
    alone = _left_alone(description, case)
    robot = moving(description, case)
    robot.tick(case.moment)
    robot.events.clear()
    KINDS[case.kind](robot, np.random.default_rng(case.seed))
    robot.until_rest()
    robot.tick(100)
    stopped, end = np.array(robot.references), len(robot.references)
    alone = np.vstack([alone, np.repeat(alone[-1:], max(end - len(alone), 0), axis=0)])
    way = case.target - case.start
    along = way / np.linalg.norm(way)
    shares = [(path - case.start) @ along for path in (stopped, alone)]
    off = np.abs(stopped - case.start - shares[0][:, None] * along).max()
    after = slice(case.moment, None)  # from the newest reference at the stop on
    limits = TORQUE_SHARE * np.array(description.limits.torque)
    needed = np.abs(torques(description, payload, alone))
    asked = needed[case.moment - 1 :].max(axis=0)
    taken = np.abs(torques(description, payload, stopped[case.moment - 1 :])).max(axis=0)
    collisions = CollisionModel(description, body(payload))
    ends = resting_after(stopped), resting_after(alone)
    told = next((e for e in robot.events if e.duration is not None), None)
    return Outcome(
        case=case,
        ahead=float((shares[0][after] - shares[1][after][: len(shares[0][after])]).max()),
        off=float(off),
        late=ends[0] - ends[1],
        torque=float((taken / np.maximum(limits, asked)).max() - 1.0),
        heavy=float((needed / description.limits.torque).max() - 1.0),
        speeds=max(speeds(description, stopped), speeds(description, alone), key=max),
        near=CLEARANCE - collisions.nearest(stopped[after]),
        duration=PERIOD * max(ends[0] - case.moment, 0),
        told=(None, None) if told is None else (told.duration, told.way),
        way=float(np.abs(stopped[-1] - stopped[case.moment]).max()),
        speed=float(np.abs(stopped[case.moment] - stopped[case.moment - 1]).max()) / PERIOD,
    )


def moving(description, case):
    """Return a robot that has just accepted the case's move."""
    robot = Subject(description, case.start, paper_payload(description, case.mass), shaper=case.shaper)
    robot.send(c.SetSpeed, fraction=case.speed)
    reply = robot.send(
        c.MoveJ, q=tuple(case.target.tolist()),
        velocity=case.velocity, acceleration=case.acceleration, jerk=case.jerk,
    )  # fmt: skip
    assert not refused(reply), reply
    return robot


def _left_alone(description, case):
    robot = moving(description, case)
    robot.until_rest()
    robot.tick(200)  # changes below 1e-7 rad per tick count as rest, so the filter's tail still creeps
    return np.array(robot.references)
