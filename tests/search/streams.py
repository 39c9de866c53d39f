"""Streams of set-points to the floor, to the arm itself and to limits, ended at random."""

from dataclasses import dataclass

import numpy as np
from tests.search import draws
from tests.search.draws import WITHIN
from tests.search.stops import KINDS, Halt
from tests.search.subject import Subject, refused, speeds

from tvist_controller.api.line import CollisionModel, JointLine, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c

LENGTH = 3.0  # duration of a stream unless something ends it [s]

ENDS: dict[str, Halt] = {
    "silence": lambda *_: None,
    "servo_stop": lambda robot, _: robot.send(c.ServoStop),
    **{
        kind: KINDS[kind]
        for kind in ("plain", "stranger's", "token gone", "power off", "protective", "emergency", "safeguard")
    },
}
"""Ways to end a stream."""
INTERPOLATION = 3 / 42
"""By so much the filter may overshoot a reference that stops at the end of a joint's range, relative to jerk and period
cubed: a cubic through four samples errs by 1/42 of that where the jerk begins or ends, and `um_zv` has three impulses.
"""


@dataclass(frozen=True)
class StreamCase:
    seed: int
    start: Floats
    towards: Floats
    mass: float
    shaper: str
    period: float
    velocity: float
    acceleration: float
    jerk: float
    end: str
    ends_at: float  # time at which it is ended [s]
    lost: float  # share of the set-points that are not sent [-]
    wave: float  # amplitude of a superimposed sine [rad]


def draw(description, seed):
    """Return a case by its number; most cases lead to a meeting."""
    random = np.random.default_rng([seed, 12])
    collisions = CollisionModel(description, body(paper_payload(description, 0.0)))
    mass = draws.mass(description, random)
    collisions.declare(body(paper_payload(description, mass)))
    while True:
        start, towards = draws.postures(description, random, 2)
        if random.random() < 0.5:  # through the floor
            towards[1] = start[1] + random.choice([-1.0, 1.0]) * random.uniform(1.0, 3.0)
        if collisions.meeting(start) is not None:
            continue
        if random.random() < 0.2 or collisions.on_way(JointLine(start, towards).whole) is not None:
            break
    return StreamCase(
        seed=seed,
        start=start,
        towards=towards,
        mass=mass,
        shaper=draws.shaper(description, random),
        period=float(random.choice([0.002, 0.002, 0.008, 0.02])),
        **draws.limits(description, random),
        end=str(random.choice(list(ENDS))),
        ends_at=float(random.uniform(0.05, LENGTH)),
        lost=float(random.choice([0.0, 0.0, 0.05, 0.3])),
        wave=float(random.choice([0.0, 0.05])),
    )


def eased(share):
    """Share of a way from rest to rest that is covered after a share of its time [-]."""
    share = min(share, 1.0)
    return share * share * (3.0 - 2.0 * share)


def judge(description, case):
    """Send the stream: it keeps the clearance, the ranges and the limits, and what is too fast is counted."""
    random = np.random.default_rng([case.seed, 13])
    robot = Subject(
        description, case.start, paper_payload(description, case.mass), shaper=case.shaper,
        clock="realtime",
    )  # fmt: skip
    limits = {"velocity": case.velocity, "acceleration": case.acceleration, "jerk": case.jerk}
    reply = robot.send(c.ServoStart, period=case.period, **limits)
    assert not refused(reply), reply
    way, every = case.towards - case.start, max(round(case.period / PERIOD), 1)
    duration = float(np.abs(way).max()) / case.velocity * random.uniform(0.8, 2.0) + 0.1
    reach = np.array(description.limits.position)
    sent: list[Floats] = []
    for tick in range(round(LENGTH / PERIOD)):
        if tick == round(case.ends_at / PERIOD):
            ENDS[case.end](robot, random)
            if case.end == "silence":
                break
        if not robot.controller.motion.streaming:
            break
        if tick % every == 0 and random.random() >= case.lost:
            time = tick * PERIOD
            bump = case.wave * np.sin(20.0 * time) * min(5.0 * time, 1.0)
            q = case.start + eased(time / duration) * way + bump
            sent.append(np.clip(q, -reach, reach))
            robot.setpoint(tick // every, sent[-1])
        robot.tick()
    robot.until_rest(5000)
    robot.tick(20)
    references = np.array(robot.references)
    steps = []
    if case.lost == 0.0 and len(sent) > 1:
        steps = np.abs(np.diff(sent, axis=0)).max(axis=1) / case.period
    rushed = np.count_nonzero(np.greater(steps, 1.5 * case.velocity)) > 10
    collisions = CollisionModel(description, body(paper_payload(description, case.mass)))
    assert all(collisions.meeting(q) is None for q in references), case
    assert (np.abs(references) - reach).max() <= INTERPOLATION * case.jerk * PERIOD**3, case
    assert max(speeds(description, references)) <= WITHIN, case
    assert robot.controller.motion.streams.counters()[2] > 0 or not rushed, case
