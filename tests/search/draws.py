"""Random postures, payloads and limits of motions, for any arm."""

import numpy as np

from tvist_lab.workspace import workspace
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
