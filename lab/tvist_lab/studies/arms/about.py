"""What a robot file says of an arm, and where its numbers come from."""

from typing import Any

from tvist_controller.api.line import calibrations, load_calibration
from tvist_plant.description import RobotDescription
from tvist_plant.robot_tables import ORIGINS
from tvist_plant.similar import stretched


def about(name: str, description: RobotDescription) -> dict[str, Any]:
    """Return an arm as `tvist robots --json` describes it.

    Args:
        name: Name or file by which the arm is served.
        description: The arm.
    """
    limits, drives = description.limits, description.drives
    known = [load_calibration(name) for name in calibrations()]
    return {
        "name": name,
        "model": description.robot.model,
        "joints": list(description.robot.joints),
        "length_m": stretched(description.kinematics),
        "payload_kg": limits.payload,
        "torque_n_m": list(limits.torque),
        "velocity_rad_s": list(limits.velocity),
        "gear_stiffness_n_m_rad": list(drives.gear_stiffness),
        "bending_stiffness_n_m_rad": dict(
            zip(
                (description.robot.joints[link] for link in description.link_flexibility.links),
                description.link_flexibility.stiffness,
                strict=True,
            )
        ),
        "collision_bodies": len(description.collision.bodies),
        "origins": {
            kind: {
                key: origin.partition(":")[2].strip()
                for key, origin in description.provenance.items()
                if origin.startswith(kind)
            }
            for kind in ORIGINS
        },
        "calibrations": [one.name for one in known if one.robot == description.robot.model],
    }
