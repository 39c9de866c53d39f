"""Fingerprint of an arm's vibration properties, to tell whether two robot files describe the same arm."""

from hashlib import sha256

import msgspec

from tvist_plant.description import RobotDescription

_DRIVES = (
    "gear_stiffness",
    "gear_damping",
    "rotor_inertia",
    "velocity_gain",
    "position_gain",
    "integral_gain",
    "coulomb_friction",
    "friction_width",
)
"""Parameters of the drives that determine frequency and damping; feed-forward and gear error only excite vibration."""


def fingerprint(description: RobotDescription) -> str:
    """Return a fingerprint of everything that affects vibration: geometry, masses, springs, dampers and drive gains.

    Names, limits, poses, collision bodies, sensors and the payload are left out; a calibration itself contains the
    payload that it was measured with. The 16 hexadecimal digits are equal for equal numbers on every machine.
    """
    drives = description.drives
    parts = (
        description.kinematics,
        description.links,
        description.link_flexibility,
        [getattr(drives, name) for name in _DRIVES],
    )
    return sha256(msgspec.json.encode(parts, order="sorted")).hexdigest()[:16]
