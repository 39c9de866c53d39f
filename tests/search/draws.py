"""Random postures, payloads and limits of motions, for any arm."""

import numpy as np

from tvist_lab.workspace import workspace
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import TrajectoryPoint
from tvist_shaping import BUILT_IN

Random = np.random.Generator

SHAPERS = BUILT_IN.names()  # every shaper that comes with the package
WITHIN = 1.003  # largest velocity and acceleration of a joint, relative to its limits [-]
ROUNDING = 1e-9  # differences between positions below this are rounding errors [rad]
CODES = {"velocity": "limit_velocity", "acceleration": "limit_acceleration", "jerk": "out_of_range"}
"""Limits of a motion, and the codes with which the robot refuses values above its own."""


def postures(description, random, count):
    """Return random postures of the workspace with turned wrists, shape (count, n) [rad]."""
    region = workspace(description)
    found = region.random(count, description.joints, int(random.integers(2**31)))
    reach = np.minimum(description.limits.position[4:], 2.0)
    found[:, 4:] = random.uniform(-reach, reach, found[:, 4:].shape)
    return found


def mass(description, random):
    """Return the mass of a payload, often none or the rated one [kg]."""
    rated = description.limits.payload
    return float(random.choice([0.0, rated, random.uniform(0.0, rated)]))


def shaper(description, random):
    """Return the name of a shaper that needs no more modes than the arm has."""
    modes = description.joints + 2 * len(description.link_flexibility.links)
    return str(random.choice([name for name in SHAPERS if BUILT_IN.modes_of(name) <= modes]))


def own_limits(description):
    """Return the highest limits that the robot accepts for a motion."""
    return {name: min(getattr(description.limits, name)) for name in CODES}


def limits(description, random, slowest=0.06):
    """Return limits of a motion: some are the arm's own, some far below, the velocity `slowest` of it at least."""
    most = own_limits(description)
    share, gentle, hard = random.uniform(slowest, 1.0), random.uniform(0.05, 0.2), random.uniform(0.2, 1.0)
    return {
        "velocity": most["velocity"] * float(random.choice([share, 1.0])),
        "acceleration": most["acceleration"] * float(random.choice([gentle, hard, 1.0])),
        "jerk": most["jerk"] * float(random.choice([0.025, 0.05, 0.25, 1.0])),
    }


def above(description, random):
    """Return the name of a limit and a value of it that the robot must refuse."""
    name = str(random.choice(list(CODES)))
    return name, own_limits(description)[name] * float(random.choice([1.0001, random.uniform(1.0, 3.0)]))


def points(random, q, kind):
    """Return points of a trajectory from a posture: one in ten hurries somewhere, most others keep the limits.

    The kinds are "linear" (dense points of a smooth motion), "cubic" and "quintic".
    """
    count = int(random.integers(1, 6))
    if kind == "linear":
        count = int(random.integers(300, 900))
        swing = 0.5 - 0.5 * np.cos(np.pi * np.arange(count + 1) / count)
        positions = q + swing[:, None] * random.uniform(-0.2, 0.2, len(q))
        gaps = np.full(count, PERIOD * random.choice([1.0, 1.5, 2.0]))
    else:
        positions = q + np.cumsum(random.uniform(-0.3, 0.3, (count + 1, len(q))), axis=0)
        gaps = random.uniform(0.5, 1.5, count)
    positions[0] = q
    speeds, bends = random.uniform(-0.3, 0.3, (2, count + 1, len(q)))
    speeds[[0, -1]] = 0.0
    if random.random() < 0.1:
        gaps[int(random.integers(count)) :] *= random.uniform(0.02, 0.3)
    times = np.concatenate(([0.0], np.cumsum(gaps)))
    given = {"q": positions} | {
        "linear": {},
        "cubic": {"qd": speeds},
        "quintic": {"qd": speeds, "qdd": bends},
    }[kind]
    first = int(random.random() < 0.5)  # the start may be left out, where it has no acceleration
    bends[0] *= 1 - first
    return tuple(
        TrajectoryPoint(
            time=float(time), **{name: tuple(rows[number].tolist()) for name, rows in given.items()}
        )
        for number, time in enumerate(times)
        if number >= first
    )
