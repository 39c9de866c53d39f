"""Stops of every kind at random moments of accepted moves, compared with the same moves without a stop."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from tests.search import draws
from tests.search.draws import ROUNDING, WITHIN
from tests.search.subject import CLIENT, SESSION, Subject, refused, speeds, torques

from tvist_controller.api.line import (
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

EARLY = 17  # tick before which some moves are stopped, to test moves that have barely begun
BARELY, BARELY_WAY = 3e-3, 1e-3
"""A joint that moves no faster than this [rad/s] moves no farther than this when it is stopped [rad]."""
PAUSES = {"pause", "safeguard"}
"""Kinds of stops that slow down the motion's own time, through the filter."""
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
    moment: int  # tick of the move at which it is stopped


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
    """Stop the move: compared with the uninterrupted one it stays on its line, behind it, and rests no later."""
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
    line = case.target - case.start
    along = line / np.linalg.norm(line)
    share, free = ((path - case.start) @ along for path in (stopped, alone))
    after = slice(case.moment, None)  # from the newest reference at the stop on
    assert (share[after] - free[after][: len(share[after])]).max() <= ROUNDING, case
    assert np.abs(stopped - case.start - share[:, None] * along).max() <= ROUNDING, case
    ends = resting_after(stopped), resting_after(alone)
    assert ends[0] <= ends[1], case
    # Within 90 % of the torque limits, or what the uninterrupted move takes.
    needed = np.abs(torques(description, payload, alone))
    assert (needed / description.limits.torque).max() <= 1.0 + TORQUE_ROUNDING, case
    most = np.maximum(
        TORQUE_SHARE * np.array(description.limits.torque), needed[case.moment - 1 :].max(axis=0)
    )
    taken = np.abs(torques(description, payload, stopped[case.moment - 1 :])).max(axis=0)
    assert (taken / most).max() <= 1.0 + TORQUE_ROUNDING, case
    assert max(*speeds(description, stopped), *speeds(description, alone)) <= WITHIN, case
    collisions = CollisionModel(description, body(payload))
    assert all(collisions.meeting(q) is None for q in stopped[after]), case
    way = float(np.abs(stopped[-1] - stopped[case.moment]).max())
    speed = float(np.abs(stopped[case.moment] - stopped[case.moment - 1]).max()) / PERIOD
    assert speed > BARELY or way <= BARELY_WAY or case.kind in PAUSES, case
    told = next((event for event in robot.events if event.duration is not None), None)
    if told is not None:
        assert told.duration == pytest.approx(PERIOD * max(ends[0] - case.moment, 0), abs=3 * PERIOD), case
        assert told.way == pytest.approx(way, abs=1e-6), case


def moving(description, case):
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
