"""Changes during motion: payload, shaper, estimator, speed and reduced speed, in moves and streams."""

import numpy as np
from tests.search import draws, stops, streams
from tests.search.draws import WITHIN
from tests.search.subject import Subject, speeds

from tvist_controller.api.line import CLEARANCE, CollisionModel, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c
from tvist_protocol.io import SetTcp
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.values import Payload

Change = tuple[type, dict[str, object]]


def judge(description, seed):
    """Change something at a random moment of a motion, and sometimes stop it then: clearance and limits are kept."""
    random = np.random.default_rng([seed, 14])
    robot = _under_way(description, seed, random)
    before = len(robot.references)
    resting = robot.controller.cycle.mode.at_rest
    kind, fields = _draw(description, random)
    reply = robot.send(kind, **fields)
    later = int(random.integers(0, 600))
    for tick in range(3000):
        if tick == later and random.random() < 0.5:
            robot.send(c.Stop, deceleration=float(random.choice([1.0, 40.0])))
        if robot.controller.motion.streaming:
            robot.setpoint(10_000 + tick, robot.references[-1])
            if tick == later:
                robot.send(c.ServoStop)
        robot.tick()
        if robot.resting and not robot.controller.motion.streaming:
            break
    collisions = CollisionModel(description, body(robot.controller.declared))
    case = seed, kind.__name__, reply
    # At rest any payload may be declared, since it does not move.
    assert resting or collisions.nearest(np.array(robot.references[before:])) >= CLEARANCE, case
    assert max(speeds(description, np.array(robot.references))) <= WITHIN, case


def far_payload(random, rated):
    """Return a payload within the rating, with its centre of mass up to 0.3 m out."""
    mass = float(random.uniform(0.1, rated))
    direction = random.normal(size=3)
    com: Floats = direction / np.linalg.norm(direction) * random.uniform(0.0, 0.3)
    moment = 0.002 * mass
    return Payload(mass=mass, com=(com[0], com[1], com[2]), inertia=(moment, 0.0, 0.0, moment, 0.0, moment))


def _draw(description, random):
    payload = far_payload(random, description.limits.payload)
    one: Change = (c.SetPayload, {"mass": payload.mass, "com": payload.com, "inertia": payload.inertia})
    others: list[Change] = [
        (c.SetShaper, {"name": draws.shaper(description, random)}),
        (c.SetEstimator, {"name": "modal"}),
        (c.SetEstimator, {"name": "fixed", "f_d": (float(random.uniform(4, 20)),), "zeta": (0.1,)}),
        (c.SetSpeed, {"fraction": float(random.uniform(0.0, 1.0))}),
        (SetTcp, {"offset": (0.0, 0.0, float(random.uniform(0.0, 0.3)), 0.0, 0.0, 0.0)}),
        (SimulationInject, {"fault": "reduced"}),
    ]
    return one if random.random() < 0.6 else others[int(random.integers(len(others)))]


def _under_way(description, seed, random):
    """Return a robot during a move, during a stream, or shortly after one of them."""
    if random.random() < 0.6:
        case = stops.draw(description, seed)
        robot = stops.moving(description, case)
        robot.tick(case.moment)
    else:
        stream = streams.draw(description, seed)
        robot = Subject(
            description, stream.start, paper_payload(description, stream.mass), shaper=stream.shaper
        )
        robot.send(c.ServoStart, velocity=stream.velocity, acceleration=stream.acceleration, jerk=stream.jerk)
        way = stream.towards - stream.start
        duration = float(np.abs(way).max()) / stream.velocity + 0.1
        for tick in range(int(random.integers(20, 500))):
            robot.setpoint(tick, stream.start + streams.eased(tick * PERIOD / duration) * way)
            robot.tick()
    match int(random.integers(6)):
        case 0:
            robot.send(c.Stop, deceleration=1.0)
        case 1:
            robot.send(c.ServoStop)
        case 2:
            robot.send(c.Pause)
    return robot
