"""A hidden robot: an arm that is not quite its file, drawn from a seed and told to nobody.

A controller that knows the file alone stands before it as before a real robot: each gear and link is softer or stiffer,
its dampers, loops, rotors and friction are others, and what it carries is not quite what it was said to carry. All
factors are uniform within 1 ± a share, and independent of each other.
"""

from typing import Any, Final

import numpy as np
from msgspec.structs import replace

from tvist_plant.robot_tables import Drives, LinkFlexibility, Payload, RobotDescription

DRIVES: Final = {
    "gear_stiffness": 0.2,
    "gear_damping": 0.2,
    "velocity_gain": 0.3,
    "rotor_inertia": 0.2,
    "coulomb_friction": 0.2,
    "friction_width": 0.2,
}
"""Largest relative deviation of each joint's drive; the width is one for all joints [-]."""
LINKS: Final = {"stiffness": 0.2, "damping_time": 0.2}
"""Largest relative deviation of each link that bends; the time is one for all links [-]."""
MASS: Final = 0.15
"""Largest relative deviation of the carried mass from the declared one [-]."""
CENTRE: Final = 0.015
"""Largest deviation of the carried centre of mass along each axis of the flange [m]."""


def hidden(description: RobotDescription, seed: int) -> RobotDescription:
    """Draw the robot behind a robot file, which is all that a controller knows, by a seed of at least 0.

    Its springs, dampers, loops, rotors and friction differ; kinematics, masses, limits and sensors are the
    file's.
    """
    random = np.random.default_rng([seed, 53])

    def drawn(table: Drives | LinkFlexibility, shares: dict[str, float]) -> dict[str, Any]:
        found = {}
        for name, share in shares.items():
            value = getattr(table, name)
            found[name] = (
                np.array(value) * random.uniform(1.0 - share, 1.0 + share, np.shape(value))
            ).tolist()
        return {name: tuple(value) if isinstance(value, list) else value for name, value in found.items()}

    drives, links = description.drives, description.link_flexibility
    return replace(
        description,
        drives=replace(drives, **drawn(drives, DRIVES)),
        link_flexibility=replace(links, **drawn(links, LINKS)),
    )


def hidden_payload(declared: Payload, seed: int) -> Payload:
    """Return what a hidden robot carries when somebody says that it carries a payload; nothing stays nothing.

    The same seed, at least 0, gives the same error each time.
    """
    if declared.mass == 0.0:
        return declared
    random = np.random.default_rng([seed, 59])
    factor = float(random.uniform(1.0 - MASS, 1.0 + MASS))
    x, y, z = (np.array(declared.com) + random.uniform(-CENTRE, CENTRE, 3)).tolist()
    xx, xy, xz, yy, yz, zz = (factor * value for value in declared.inertia)
    return Payload(mass=factor * declared.mass, com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))
