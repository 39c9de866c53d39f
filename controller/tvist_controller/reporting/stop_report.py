"""Stopping times and distances, as a safety report requires them."""

from functools import cache

import msgspec
import numpy as np

from tvist_controller.foresight.stops import StopPlanner
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Stopping

SPEEDS = (0.33, 0.66, 1.0)
"""Shares of a joint's velocity at which stops begin, as in UR's manuals [-]."""
POSTURES = 500
"""Number of random postures searched for the one that needs most torque to hold: the arm stretched out."""


def stopping(description: RobotDescription) -> tuple[Stopping, ...]:
    """Return the stops without payload and with the rated one, of the joint that takes the longest.

    In each stop a single joint turns, in either direction, while the others are at rest and the arm is stretched out.
    Computing them takes as long as twenty ticks, once for each description.

    Args:
        description: The robot.
    """
    return _found(msgspec.json.encode(description))


@cache
def _found(described: bytes) -> tuple[Stopping, ...]:
    description, rows = msgspec.json.decode(described, type=RobotDescription), []
    for mass in (0.0, description.limits.payload):
        dynamics = InverseDynamics(description, body(paper_payload(description, mass)))
        planner = StopPlanner(description, dynamics, PERIOD)
        q = _stretched(description, dynamics)
        for speed in SPEEDS:
            found = [
                (stop.duration, float(np.abs(stop.end - q).max()), name)
                for joint, name in enumerate(description.robot.joints)
                for sign in (-1.0, 1.0)
                if (
                    stop := planner.by_joints(
                        _turning(q, joint, sign * speed * description.limits.velocity[joint]),
                        None,
                        lambda _: True,
                    )
                )
            ]
            if found:
                duration, way, name = max(found)
                rows.append(Stopping(payload=mass, speed=speed, joint=name, duration=duration, way=way))
    return tuple(rows)


def _stretched(description: RobotDescription, dynamics: InverseDynamics) -> Floats:
    """Return the posture that needs the largest share of a joint's torque to hold."""
    random, limits = np.random.default_rng(0), np.array(description.limits.torque)
    named = [np.array(pose) for pose in description.poses.values()]
    postures = [*named, *random.uniform(-np.pi, np.pi, (POSTURES, description.joints))]
    return max(postures, key=lambda q: float((np.abs(dynamics.gravity(q)) / limits).max()))


def _turning(q: Floats, joint: int, velocity: float) -> Target:
    qd = np.zeros_like(q)
    qd[joint] = velocity
    return Target(q, qd, np.zeros_like(q))
