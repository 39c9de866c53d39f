"""Robots that move along curves, of which the wire has none yet."""

from dataclasses import replace

import numpy as np
from tests.search.draws import SHAPERS
from tests.search.subject import Subject

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_protocol import commands as c

from .curves import quickest_on, random_arc, tool_circle
from .robots import PAPER, UR5E, setup

DISC = paper_payload(UR5E, 5.0)
ON = 1e-9
"""Distance from a curve that is none [rad]."""
BACK = 1e-6
"""By so much interpolation in the filter may undershoot where a motion hardly moves, on straight lines too [rad]."""
EXCESS = 1.01
"""Share of a limit that a filter whose weights vary may reach [-]."""
POSITIVE = [name for name in SHAPERS if not (name.startswith("um_") or name.endswith("_exact"))]


def free(curve) -> bool:
    return CollisionModel(UR5E, body(DISC)).on_way(curve.whole) is None


def curve_of(seed: int):
    """A tool circle now and then, else an arc that is clear."""
    random = np.random.default_rng([seed, 3])
    if seed % 4 == 0:
        return tool_circle()
    while True:
        curve = random_arc(random)
        if free(curve):
            return curve


def moving(curve, shaper: str, limits: MotionLimits, speed: float = 1.0) -> Subject:
    """A robot that has just begun a motion along a curve."""
    robot = Subject(UR5E, curve.posture(curve.start), DISC, shaper=shaper)
    robot.send(c.SetSpeed, fraction=speed)
    start(robot, curve, limits)
    return robot


def start(robot: Subject, curve, limits: MotionLimits = PAPER) -> None:
    """Begin a motion along a curve, as a command for it would."""
    own, now, arm = setup(payload=DISC), robot.controller.snapshot(), arm_limits(UR5E)
    filters = FilterPlanner(own)

    def make(slower):
        acceleration = limits.acceleration * slower.acceleration * (1.0 - now.excess)
        kept = replace(limits, velocity=limits.velocity * slower.velocity, acceleration=acceleration)
        return quickest_on(curve, kept, rate_of(now.speed, limits.velocity, now.slowest))

    fitted = MovePlanner(own, filters).fit(make, now, lambda: filters.like(now.filter), limits)
    velocity, most = (
        limits.velocity * fitted.slower.velocity,
        limits.acceleration * fitted.slower.acceleration,
    )
    room = arm.velocity / velocity, arm.acceleration / most
    moved = PlannedMove((fitted.motion,), velocity, fitted.limited, room=room, surplus=now.surplus)
    robot.controller.motion.move(moved)


def played(robot: Subject, ticks: int = 200) -> np.ndarray:
    """All references until it rests, and some more ticks."""
    robot.until_rest()
    robot.tick(ticks)
    return np.array(robot.references)


def random_limits(random) -> MotionLimits:
    return MotionLimits(
        float(random.uniform(0.5, 3.14)),
        float(random.uniform(1.0, 8.0)),
        float(random.choice([100.0, 500.0, 2000.0])),
    )
